//! The extractor and the link: the corner under the cursor with its circle and score, and what leaves the chip.
import { bits, byId, colours, make, sheet, short, time } from "./ink.js";
import type { Summary } from "./simulator.js";

export interface Corner {
  number: number; x: number; y: number; pixel: [number, number]; score: number; angle_turns: number; bits: number; threshold: number;
  smoothed: boolean; left: number; top: number; values: number[][]; circle: [number, number][]; descriptor: number[];
  out_clk: number | null; pixel_rate_hz: number;
}

export class Features {
  private readonly canvas = byId<HTMLCanvasElement>("corner");
  private readonly lanes = byId<HTMLCanvasElement>("lanes");
  private corner: Corner | undefined;
  private packets: Float64Array = new Float64Array();

  constructor() {
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  showCorner(corner: Corner | undefined): void {
    this.corner = corner;
    this.draw();
  }

  showPackets(packets: Float64Array, summary: Summary): void {
    this.packets = packets;
    const { bandwidth, timing } = summary;
    const rows: [string, string][] = [
      ["Raw picture", bits(summary.raw_bits)],
      ["Feature packets", bits(summary.feature_bits)],
      ["Raw over features", bandwidth.reduction === null ? "–" : `${short(bandwidth.reduction)} ×`],
      ["Link in use", `${short(100 * bandwidth.link_utilisation)} %`],
      ["Corners a frame, mean", short(summary.extractor.corners)],
      ["Extractor clocks", timing.extractor ? `${short(timing.extractor.required)} of ${short(timing.extractor.available)}` : "–"],
      ["Stalled clocks", short(summary.extractor.stalled_clk)],
      ["Last bit after mid-exposure", time(timing.latency_us)],
    ];
    byId("link-figures").replaceChildren(...rows.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))));
    const widest = Math.max(summary.raw_bits, summary.feature_bits);
    byId("bits-bars").replaceChildren(...([["Raw", summary.raw_bits, "send"], ["Features", summary.feature_bits, "feature"]] as const).map(
      ([name, value, colour]) => {
        const bar = make("span", { class: "bar", style: `width:${(100 * value) / widest}%;background:var(--${colour})` });
        const track = make("span", { class: "track" }, bar);
        return make("div", { class: "bar-row" }, make("span", {}, name), track, make("span", {}, bits(value)));
      }));
    this.draw();
  }

  draw(): void {
    if (this.canvas.clientWidth === 0) return;
    this.drawCorner();
    this.drawLanes();
  }

  private drawCorner(): void {
    const { context, width, height } = sheet(this.canvas), tint = colours(), { corner } = this;
    const text = byId("corner-text");
    if (!corner) {
      text.textContent = "No corner in this frame. A lower threshold, or more light, finds some.";
      context.strokeStyle = tint.line;
      context.strokeRect(0.5, 0.5, width - 1, height - 1);
      return;
    }
    const rows = corner.values.length, columns = corner.values[0]!.length, cell = Math.min(width / columns, height / rows);
    const [cx, cy] = corner.pixel, centre = corner.values[cy - corner.top]?.[cx - corner.left] ?? 0;
    const grey = (value: number): number => Math.round((255 * value) / (2 ** corner.bits - 1));
    corner.values.forEach((row, y) => row.forEach((word, x) => {
      const value = grey(word);
      context.fillStyle = `rgb(${value} ${value} ${value})`;
      context.fillRect(x * cell, y * cell, cell + 0.5, cell + 0.5);
    }));
    let [brighter, darker] = [0, 0];
    context.textAlign = "center";
    context.font = `${Math.max(8, Math.min(12, cell * 0.42))}px system-ui, sans-serif`;
    for (const [dx, dy] of corner.circle) {
      const [x, y] = [cx + dx - corner.left, cy + dy - corner.top], value = corner.values[y]?.[x];
      if (value === undefined) continue;
      const difference = value - centre;
      if (difference > corner.threshold) brighter += 1;
      if (difference < -corner.threshold) darker += 1;
      context.strokeStyle = difference > corner.threshold ? "#ffb000" : difference < -corner.threshold ? "#4cc9f0" : "#888";
      context.lineWidth = 3;
      context.strokeRect(x * cell + 1.5, y * cell + 1.5, cell - 3, cell - 3);
      context.fillStyle = grey(value) > 110 ? "#000" : "#fff";
      context.fillText(String(value), (x + 0.5) * cell, (y + 0.5) * cell + 4);
    }
    context.strokeStyle = "#fff";
    context.strokeRect((cx - corner.left) * cell + 1.5, (cy - corner.top) * cell + 1.5, cell - 3, cell - 3);
    context.fillStyle = grey(centre) > 110 ? "#000" : "#fff";
    context.fillText(String(centre), (cx - corner.left + 0.5) * cell, (cy - corner.top + 0.5) * cell + 4);
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "start";
    const left = corner.out_clk === null ? "" : time((1e6 * corner.out_clk) / corner.pixel_rate_hz);
    const out = left && ` It left the extractor ${left} after the first pixel.`;
    text.textContent = `Corner ${corner.number} at ${short(corner.x, 5)}, ${short(corner.y, 5)}: of the 16 pixels around it, ` +
      `${brighter} are brighter and ${darker} darker than the centre by more than ${corner.threshold}. Score ${corner.score}: the ` +
      `largest threshold at which it stays a corner. Orientation ${short(360 * corner.angle_turns)}°.${out}` +
      (corner.smoothed ? " Codes of so few bits are smoothed before the test; the window shows them before." : "");
  }

  private drawLanes(): void {
    const { context, width, height } = sheet(this.lanes), tint = colours(), { packets } = this;
    if (packets.length === 0) return;
    const start = packets[4]!, end = packets[packets.length - 1]!, left = 0;
    const x = (us: number): number => left + ((us - start) / (end - start)) * (width - left);
    const fill = [tint.soft, tint.send, tint.feature];
    for (let at = 0; at < packets.length; at += 6) {
      const [kind, from, until] = [packets[at]!, packets[at + 4]!, packets[at + 5]!];
      context.fillStyle = fill[kind]!;
      const tall = kind === 2 ? height - 20 : (height - 20) * 0.62;
      context.fillRect(x(from), height - 20 - tall, Math.max(0.6, x(until) - x(from) - 0.2), tall);
    }
    context.fillStyle = tint.soft;
    context.fillText(time(start), 0, height - 4);
    context.textAlign = "right";
    context.fillText(`${time(end)} after the exposure began`, width, height - 4);
    context.textAlign = "start";
    const of = (kind: number): number => packets.filter((_, place) => place % 6 === 0).filter((value) => value === kind).length;
    byId("lanes-text").textContent = `${of(1)} packets of rows, ${of(2)} of features, ${of(0)} short and embedded ones.`;
  }
}
