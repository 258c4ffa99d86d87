//! The noise of a frame taken apart by effect, and the photon-transfer curve of the same sensor.
import type uPlot from "./uPlot.esm.js";
import { byId, colours, make, short, sheet } from "./ink.js";
import { paint } from "./picture.js";
import { plots } from "./plots.js";
import type { Summary } from "./simulator.js";

interface Part {
  name: string; summary: string; mean_e: number; sigma_e: number; variance_e2: number; share: number; reach_e: number; histogram: number[];
}
export interface NoiseAnswer { total_e2: number; parts: Part[] }
export interface TransferAnswer {
  points: { photons: number; signal_dn: number; variance_dn2: number; total_dn2: number }[];
  saturation: number; fitted: number; figures: Record<string, number | null>;
}

/** Effects whose names are abbreviations or say little, in words. */
const spelled: Record<string, string> = {
  prnu: "gain spread (PRNU)", dsnu: "dark spread (DSNU)", ktc_noise: "reset noise (kTC)", full_well: "clipping (full well)",
};

const wordsOf = (name: string): string => spelled[name] ?? name.replaceAll("_", " ");

export class Noise {
  private answer: NoiseAnswer | undefined;
  private curve: uPlot | undefined;
  private chosen = "";

  constructor(
    private readonly picture: (number: number) => Promise<Uint8Array<ArrayBuffer>>,
    private readonly switched: (name: string, on: boolean) => void,
    private readonly size: () => { width: number; height: number },
  ) {}

  async show(answer: NoiseAnswer, summary: Summary, off: string[]): Promise<void> {
    this.answer = answer;
    const names = [...new Set([...summary.present, ...answer.parts.map((part) => part.name), ...off])];
    const rows = names.map((name) => {
      const part = answer.parts.find((one) => one.name === name);
      const omitted = summary.omitted.find(([one]) => one === name);
      return this.row(name, part, off.includes(name), omitted?.[1]);
    });
    byId("noise-rows").replaceChildren(...rows);
    byId("noise-text").textContent = `All parts together: ${short(Math.sqrt(answer.total_e2))} electrons (root mean square) over this ` +
      "picture, patterns and noise added as variances." + (answer.parts.some((part) => part.name === "full_well" && part.share > 0.5)
        ? " Most of it is clipping: something is brighter than the full well holds. Less light or exposure shows the rest." : "");
    if (!answer.parts.some((part) => part.name === this.chosen)) {
      this.chosen = [...answer.parts].sort((a, b) => b.share - a.share)[0]?.name ?? "";
    }
    await this.choose(this.chosen);
  }

  /** The largest part is shown next. */
  forget(): void {
    this.chosen = "";
  }

  private row(name: string, part: Part | undefined, off: boolean, reason: string | undefined): HTMLElement {
    const words = wordsOf(name);
    const mark = make("input", { type: "checkbox", id: `effect-${name}`, "aria-label": `simulate ${words}` });
    mark.checked = !off;
    mark.disabled = name === "quantisation";
    mark.addEventListener("change", () => this.switched(name, mark.checked));
    const button = make("button", { type: "button", class: "plain", "data-part": name }, words);
    button.disabled = !part;
    button.addEventListener("click", () => void this.choose(name));
    const share = part ? 100 * part.share : 0;
    const bar = make("span", { class: "bar", style: `width:${share}%;background:var(--accent)` });
    const figure = part ? `${short(part.sigma_e)} e-` : off ? "off" : "left out";
    const tail = part ? `${share < 0.1 ? "< 0.1" : short(share, 3)} %` : "";
    const row = make("li", { class: "noise-row" }, mark, button, make("span", { class: "track" }, bar), make("span", {}, figure),
      make("span", {}, tail));
    row.title = part ? part.summary : reason ?? "";
    return row;
  }

  private async choose(name: string): Promise<void> {
    const number = this.answer!.parts.findIndex((part) => part.name === name), part = this.answer!.parts[number];
    if (!part) return;
    this.chosen = name;
    for (const button of document.querySelectorAll("[data-part]")) {
      button.setAttribute("aria-pressed", String((button as HTMLElement).dataset.part === name));
    }
    const { width, height } = this.size();
    paint(byId<HTMLCanvasElement>("noise-picture"), await this.picture(number), width, height);
    byId("part-text").textContent = `${wordsOf(name)}: ${part.summary}. Grey is its mean of ${short(part.mean_e)} e-, ` +
      `white and black are ${short(part.reach_e)} e- more and less.`;
    this.histogram(part);
  }

  private histogram(part: Part): void {
    const { context, width, height } = sheet(byId<HTMLCanvasElement>("noise-histogram")), tint = colours();
    const most = Math.max(1, ...part.histogram), wide = width / part.histogram.length;
    context.fillStyle = tint.accent;
    part.histogram.forEach((count, place) => {
      const tall = ((height - 20) * count) / most;
      context.fillRect(place * wide, height - 18 - tall, Math.max(1, wide - 1), tall);
    });
    context.fillStyle = tint.soft;
    context.fillText(`${short(most)} pixels`, 0, 10);
    context.fillText(`${short(part.mean_e - part.reach_e)} e-`, 0, height - 4);
    context.textAlign = "right";
    context.fillText(`${short(part.mean_e + part.reach_e)} e-`, width, height - 4);
    context.textAlign = "start";
  }

  async showTransfer(answer: TransferAnswer): Promise<void> {
    const UPlot = await plots(), tint = colours(), host = byId("transfer-plot");
    const lit = answer.points.filter((point) => point.signal_dn > 0 && point.variance_dn2 > 0);
    this.curve?.destroy();
    const gain = answer.figures.K ?? NaN, signal = lit.map((point) => point.signal_dn);
    const data: uPlot.AlignedData = [signal, lit.map((point) => point.variance_dn2), signal.map((dn) => dn * gain)];
    const axis = { stroke: tint.soft, grid: { stroke: tint.grid, width: 1 }, ticks: { stroke: tint.grid, width: 1 } };
    this.curve = new UPlot({
      width: host.clientWidth || 320, height: 240, legend: { show: false }, scales: { x: { time: false, distr: 3 }, y: { distr: 3 } },
      axes: [{ ...axis, label: "signal above dark, DN" }, { ...axis, label: "variance above dark, DN²", size: 60 }],
      series: [{}, { stroke: tint.accent, width: 0, points: { show: true, size: 6, fill: tint.accent } },
        { stroke: tint.ramp, width: 1.5, dash: [5, 4], points: { show: false } }],
    }, data, host);
    const figure = (name: string, label: string, unit: string): HTMLElement => {
      const value = answer.figures[name];
      const words = value === null || value === undefined ? "not measurable" : `${short(value)} ${unit}`;
      return make("div", {}, make("dt", {}, label), make("dd", {}, words));
    };
    byId("transfer-figures").replaceChildren(figure("K", "System gain", "DN/e-"), figure("sigma_d", "Dark noise", "e-"),
      figure("u_e_sat", "Saturation", "e-"), figure("SNR_max_dB", "Best signal to noise", "dB"), figure("DR_dB", "Dynamic range", "dB"));
  }
}
