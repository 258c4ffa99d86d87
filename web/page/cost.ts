//! Pose, energy, latency, and where the time of this machine goes: figures of the run so far.
import type uPlot from "./uPlot.esm.js";
import { byId, colours, energy, make, sheet, short, time } from "./ink.js";
import { plots } from "./plots.js";
import { drawPhases, fitLanes } from "./rows.js";
import type { Summary } from "./simulator.js";

const fields = 8;

export interface AccuracyRow {
  name: string; ms: number; sensor_ms: number; rms_dn: number; max_dn: number; render_variance_ratio: number | null;
}

const blockNames: Record<string, string> = { adc: "converters", compute: "extractor" };

const railNames: Record<string, string> = { io: "I/O" };

const blockName = (name: string): string => blockNames[name] ?? name.replaceAll("_", " ");

export function bars(host: HTMLElement, values: [name: string, value: number, note: string][], colour: string): void {
  const most = Math.max(...values.map(([, value]) => value), 1e-30);
  host.replaceChildren(...values.map(([name, value, note]) => {
    const bar = make("span", { class: "bar", style: `width:${(100 * value) / most}%;background:var(--${colour})` });
    return make("div", { class: "bar-row" }, make("span", {}, name), make("span", { class: "track" }, bar), make("span", {}, note));
  }));
}

export function definitions(host: HTMLElement, rows: [string, string][]): void {
  host.replaceChildren(...rows.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))));
}

const millimetres = (metres: number | null): string => (metres === null ? "–" : `${short(1000 * metres)} mm`);

export class Cost {
  private trajectory: Float64Array = new Float64Array();
  private truth: Float64Array = new Float64Array();
  private summary: Summary | undefined;
  private readonly grown: [frame: number, ate_mm: number, jitter_mm: number][] = [];
  private curve: uPlot | undefined;

  constructor() {
    for (const id of ["pose-top", "pose-side", "latency"]) new ResizeObserver(() => this.draw()).observe(byId(id));
  }

  /** Keeps the figures of every frame, whichever panel is shown. */
  note(summary: Summary): void {
    if (summary.frame === 0) this.grown.length = 0;
    const { ate_m, jitter_d2_m } = summary.tracking;
    if (ate_m !== null) this.grown.push([summary.frame, 1000 * ate_m, 1000 * (jitter_d2_m ?? NaN)]);
  }

  async showPose(trajectory: Float64Array, truth: Float64Array, summary: Summary): Promise<void> {
    [this.trajectory, this.truth, this.summary] = [trajectory, truth, summary];
    const { tracking } = summary;
    definitions(byId("pose-figures"), [
      ["Path error (ATE)", millimetres(tracking.ate_m)], ["Jitter (second difference)", millimetres(tracking.jitter_d2_m)],
      ["Jitter (one frame)", millimetres(tracking.jitter_frame_m)], ["Drift over 1 s (RPE)", millimetres(tracking.rpe_m)],
      ["Frames tracked", `${short(100 * tracking.tracked_fraction)} %`], ["Features in this pose", String(summary.tracked_features)],
    ]);
    byId("pose-text").textContent = trajectory.length
      ? `Frame ${summary.frame}: the estimate lies ${short(1000 * trajectory[trajectory.length - 1]!)} mm from the truth.`
      : "The tracker has no pose yet. One camera needs motion and some tens of frames; two cameras find a pose at once. " +
        "Press Play, or set Cameras to two.";
    this.draw();
    this.grow(await plots());
  }

  private grow(UPlot: typeof uPlot): void {
    const host = byId("pose-plot"), tint = colours();
    this.curve?.destroy();
    this.curve = undefined;
    if (this.grown.length < 2 || host.clientWidth === 0) return;
    const axis = { stroke: tint.soft, grid: { stroke: tint.grid, width: 1 }, ticks: { stroke: tint.grid, width: 1 } };
    const column = (place: 0 | 1 | 2): number[] => this.grown.map((entry) => entry[place]);
    this.curve = new UPlot({
      width: host.clientWidth, height: 180, scales: { x: { time: false } }, legend: { show: false },
      axes: [{ ...axis, label: "frame" }, { ...axis, label: "mm", size: 54 }],
      series: [{}, { stroke: tint.accent, width: 2 }, { stroke: tint.ramp, width: 2 }],
    }, [column(0), column(1), column(2)], host);
  }

  showEnergy(summary: Summary): void {
    this.summary = summary;
    const { energy: spent } = summary;
    const blocks = Object.entries(spent.blocks).filter(([, pj]) => pj > 0).sort((a, b) => b[1] - a[1]);
    const mw = (pj: number): string => short((spent.power_mw * pj) / spent.total_pj);
    const range = (name: string): string => {
      const interval = spent.blocks_interval[name];
      return interval ? ` (${mw(interval.low_pj)} to ${mw(interval.high_pj)})` : "";
    };
    bars(byId("energy-blocks"), blocks.map(([name, pj]) => [blockName(name), pj, `${mw(pj)} mW${range(name)}`]), "convert");
    byId("energy-blocks").title = blocks.map(([name, pj]) => `${blockName(name)}: ${energy(pj)} a frame`).join("\n");
    bars(byId("energy-rails"), Object.entries(spent.rails).map(([name, pj]) => [railNames[name] ?? name, pj, `${mw(pj)} mW`]), "count");
    definitions(byId("energy-figures"), [
      ["Power", `${short(spent.power_mw)} mW`], ["Drawn whatever happens", `${short(spent.static_mw)} mW`],
      ["A frame", energy(spent.total_pj)],
      ["A pixel", energy(spent.pj_per_pixel)], ["Technology", spent.technology],
      ["Most of the uncertainty", spent.deciders.slice(0, 2).map((one) => one.name.replaceAll("_", " ")).join(", ")],
    ]);
    byId("energy-text").textContent = blocks.length
      ? `The largest is ${blockName(blocks[0]![0])}, with ${short((100 * blocks[0]![1]) / spent.total_pj)} % of the sensor's power. ` +
        "Periphery: references, clocks, supplies and control. In brackets: the likely range, since constants of the " +
        "technology are uncertain." : "";
    const last_us = summary.timing.feature_latency_us;
    definitions(byId("latency-figures"), [
      ["Mid-exposure to last bit", time(summary.timing.latency_us)],
      ["Last feature after the last row", last_us === null ? "–" : time(last_us)],
      ["Frame time", time(summary.frame_us)], ["Frames a second", short(summary.fps)],
    ]);
    this.draw();
  }

  showStages(summary: Summary): void {
    const total = summary.stages_ms.reduce((sum, [, ms]) => sum + ms, 0), frames = summary.frame + 1;
    bars(byId("stage-times"), summary.stages_ms.map(([name, ms]) =>
      [name.replaceAll("_", " "), ms, `${short(ms / frames)} ms`]), "accent");
    const frame_ms = total / frames;
    byId("stage-text").textContent = `${short(frame_ms)} ms per frame in this browser, ${short(1000 / frame_ms)} frames a second.`;
  }

  showAccuracy(rows: AccuracyRow[]): void {
    byId("accuracy-rows").replaceChildren(...rows.map((row) => {
      const cells = [`${short(row.ms)} ms`, `${short(row.sensor_ms)} ms`, short(row.rms_dn), String(row.max_dn),
        short(row.render_variance_ratio ?? NaN)];
      return make("tr", {}, make("th", { scope: "row" }, row.name), ...cells.map((cell) => make("td", {}, cell)));
    }));
    byId("accuracy").hidden = false;
    const [clocked, closed] = rows.slice(-2) as [AccuracyRow, AccuracyRow], cheap = rows[0]!;
    byId("accuracy-text").textContent = `Clock by clock the sensor took ${short(clocked.sensor_ms / closed.sensor_ms, 2)} times as long as in ` +
      `closed form, and its codes ${clocked.max_dn === 0 ? "are the same" : `differ by up to ${clocked.max_dn} DN`}. With one ray a pixel a frame took ` +
      `${short((100 * cheap.ms) / closed.ms, 2)} % of the last row's time, and its codes are off by ${short(cheap.rms_dn, 2)} DN (RMS).`;
  }

  private draw(): void {
    const latency = byId<HTMLCanvasElement>("latency");
    if (this.summary && latency.clientWidth > 0) {
      const phases = this.summary.timing.frame.filter((phase) => phase.name !== "blanking");
      fitLanes(latency, phases);
      const { context, width, height } = sheet(latency);
      drawPhases(context, width, height, phases, Math.max(...phases.map((phase) => phase.end_us)), colours());
    }
    this.path("pose-top", 1, 3, "top: x right, z down");
    this.path("pose-side", 1, 2, "front: x right, y up", -1);
  }

  private path(id: string, across: number, down: number, words: string, sign = 1): void {
    const canvas = byId<HTMLCanvasElement>(id);
    if (canvas.clientWidth === 0 || this.truth.length === 0) return;
    const { context, width, height } = sheet(canvas), tint = colours(), points: [number, number][] = [];
    for (let at = 0; at < this.truth.length; at += 4) points.push([this.truth[at + across]!, sign * this.truth[at + down]!]);
    const found: [number, number][] = [], shift = 3;
    for (let at = 0; at < this.trajectory.length; at += fields) {
      found.push([this.trajectory[at + across + shift]!, sign * this.trajectory[at + down + shift]!]);
    }
    const all = [...points, ...found], xs = all.map(([x]) => x), ys = all.map(([, y]) => y);
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const span = Math.max(right - left, high - low, 0.005) * 1.15, scale = Math.min(width, height - 34) / span;
    const x = (value: number): number => width / 2 + (value - (left + right) / 2) * scale;
    const y = (value: number): number => (height - 16) / 2 + (value - (low + high) / 2) * scale;
    for (const [path, colour, wide] of [[points, tint.soft, 3], [found, tint.accent, 1.5]] as const) {
      context.strokeStyle = colour;
      context.lineWidth = wide;
      context.beginPath();
      path.forEach(([px, py], place) => (place ? context.lineTo(x(px), y(py)) : context.moveTo(x(px), y(py))));
      context.stroke();
      const last = path[path.length - 1];
      if (last) {
        context.fillStyle = colour;
        context.beginPath();
        context.arc(x(last[0]), y(last[1]), 4, 0, 2 * Math.PI);
        context.fill();
      }
    }
    context.fillStyle = tint.soft;
    context.fillText(`${words}; ${short((1000 * Math.min(width, height - 34)) / scale / 1.15)} mm across`, 4, height - 4);
  }
}
