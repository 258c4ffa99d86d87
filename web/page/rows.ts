//! When each row is exposed, stored, converted and sent, to scale, beside the picture's own rows.
import { byId, colours, sheet, short, tickStep, time } from "./ink.js";
import type { Phase, Summary } from "./simulator.js";

const fields = 6;

export class Rows {
  private readonly canvas = byId<HTMLCanvasElement>("rows");
  private readonly line = byId<HTMLCanvasElement>("line-phases");
  private table: Float64Array = new Float64Array();
  private summary: Summary | undefined;
  private picture: HTMLCanvasElement | undefined;
  private row = 0;
  /** Where the time axis stands: its first pixel, first time, and us a pixel. */
  private axis = { left: 0, low: 0, scale: 1 };
  private drag: { id: "exposure" | "hts"; x: number; value: number } | undefined;

  /** `dragged` is told a control and its new value in the control's unit. */
  constructor(private readonly dragged: (id: "exposure" | "hts", value: number) => void) {
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.canvas.addEventListener("pointerdown", (event) => this.begin(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => { this.drag = undefined; });
  }

  /** A drag that starts left of the end of a row's exposure changes the exposure, one that starts right of it the line length. */
  private begin(event: PointerEvent): void {
    const box = this.canvas.getBoundingClientRect(), x = event.clientX - box.left;
    if (!this.summary || x < this.axis.left) return;
    const count = this.table.length / fields, share = (event.clientY - box.top) / box.height;
    const row = Math.min(count - 1, Math.max(0, Math.floor(share * count)));
    const us = this.axis.low + (x - this.axis.left) * this.axis.scale;
    const id = us <= this.table[row * fields + 1]! ? "exposure" : "hts";
    this.drag = { id, x, value: id === "exposure" ? this.summary.exposure_us / 1000 : this.summary.hts };
    this.canvas.setPointerCapture(event.pointerId);
  }

  private move(event: PointerEvent): void {
    const { drag, axis } = this;
    if (!drag) return;
    const x = event.clientX - this.canvas.getBoundingClientRect().left;
    if (drag.id === "exposure") this.dragged("exposure", drag.value + ((x - drag.x) * axis.scale) / 1000);
    else this.dragged("hts", drag.value * Math.max(0.1, (x - axis.left) / (drag.x - axis.left)));
  }

  show(table: Float64Array, summary: Summary, picture: HTMLCanvasElement, row: number): void {
    [this.table, this.summary, this.picture, this.row] = [table, summary, picture, row];
    const last = table.length / fields - 1, skew = table[last * fields]! - table[0]!;
    const wait = table[last * fields + 2]! - table[last * fields + 1]!;
    byId("rows-text").textContent = summary.rolling
      ? `Rolling shutter: each row starts one line, ${time(summary.line_us)}, after the row above; the last ${time(skew)} after the ` +
        "first. What moves in that time looks slanted."
      : `Global shutter: all rows start together. The last row waits ${time(wait)} in its storage node until its line comes.`;
    this.draw();
  }

  at(row: number): void {
    this.row = row;
    this.draw();
  }

  draw(): void {
    if (!this.summary || !this.picture || this.canvas.clientWidth === 0) return;
    const { context, width, height } = sheet(this.canvas), tint = colours(), { table } = this;
    const count = table.length / fields, top = 6, floor = height - 24;
    const share = Math.min(0.28 * width, ((floor - top) * this.picture.width) / this.picture.height);
    context.imageSmoothingEnabled = false;
    context.drawImage(this.picture, 0, top, share, floor - top);
    let [low, high] = [Infinity, -Infinity];
    for (const value of table) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
    const left = share + 10, right = width - 8;
    const x = (us: number): number => left + ((us - low) / (high - low)) * (right - left);
    this.axis = { left, low, scale: (high - low) / (right - left) };
    const tall = (floor - top) / count, y = (row: number): number => top + row * tall;
    context.strokeStyle = tint.grid;
    context.fillStyle = tint.soft;
    context.textAlign = "center";
    const step = tickStep(high - low, 5);
    for (let us = Math.ceil(low / step) * step; us <= high; us += step) {
      context.beginPath();
      context.moveTo(x(us), top);
      context.lineTo(x(us), floor);
      context.stroke();
      if (x(us) < width - 30) context.fillText(`${short(us / 1000)}`, x(us), height - 8);
    }
    context.textAlign = "right";
    context.fillText("ms", width - 2, height - 8);
    context.textAlign = "start";
    const spans: [number, number, string][] = [[0, 1, tint.expose], [1, 2, tint.store], [2, 3, tint.convert], [4, 5, tint.send]];
    for (const [from, until, colour] of spans) {
      context.fillStyle = colour;
      context.beginPath();
      for (let row = 0; row < count; row += 1) {
        const [start, end] = [table[row * fields + from]!, table[row * fields + until]!];
        if (end > start) context.rect(x(start), y(row), Math.max(0.75, x(end) - x(start)), tall + 0.3);
      }
      context.fill();
    }
    const at = Math.min(this.row, count - 1);
    context.strokeStyle = tint.ink;
    context.lineWidth = 1;
    context.strokeRect(0.5, y(at) - 1, width - 1, tall + 2);
    const of = (from: number): string => time(table[at * fields + from + 1]! - table[at * fields + from]!);
    byId("row-text").textContent = `Row ${at}: exposed for ${of(0)}, stored for ${of(1)}, converted in ${of(2)}` +
      (Number.isNaN(table[at * fields + 4]) ? ", not sent as a row." : `, sent in ${of(4)}.`);
    this.drawLine();
  }

  /** One line's budget: columns, lanes, link. */
  private drawLine(): void {
    const phases = this.summary!.timing.line, tint = colours();
    fitLanes(this.line, phases);
    const { context, width, height } = sheet(this.line);
    drawPhases(context, width, height, phases, this.summary!.line_us, tint);
  }
}

/** Makes a drawing as tall as its lanes and their axis. */
export function fitLanes(canvas: HTMLCanvasElement, phases: Phase[]): void {
  canvas.style.height = `${30 * new Set(phases.map((phase) => phase.lane)).size + 22}px`;
}

/** Phases by lane, to scale, over one span. */
export function drawPhases(
  context: CanvasRenderingContext2D, width: number, height: number, phases: Phase[], span_us: number, tint: ReturnType<typeof colours>,
): void {
  const lanes = [...new Set(phases.map((phase) => phase.lane))], left = 118, right = width - 8;
  const end = Math.max(span_us, ...phases.map((phase) => phase.end_us)), start = Math.min(0, ...phases.map((phase) => phase.start_us));
  const x = (us: number): number => left + ((us - start) / (end - start)) * (right - left);
  const tall = Math.min(30, (height - 22) / Math.max(1, lanes.length));
  const shade = (name: string): string => {
    if (/exposure/.test(name)) return tint.expose;
    if (/ramp|readout|conversion/.test(name)) return tint.convert;
    if (/settle|reset|transfer|latch|storage/.test(name)) return tint.store;
    if (/feature/.test(name)) return tint.feature;
    return tint.send;
  };
  lanes.forEach((lane, place) => {
    context.fillStyle = tint.soft;
    context.fillText(lane, 0, place * tall + tall / 2 + 4);
    for (const phase of phases.filter((one) => one.lane === lane)) {
      const [from, until] = [x(phase.start_us), x(phase.end_us)];
      context.fillStyle = shade(phase.name);
      context.fillRect(from, place * tall + 3, Math.max(1, until - from - 0.5), tall - 6);
      if (context.measureText(phase.name).width < until - from - 6) {
        context.fillStyle = "#000";
        context.fillText(phase.name, from + 3, place * tall + tall / 2 + 4);
      }
    }
  });
  context.fillStyle = tint.soft;
  context.textAlign = "center";
  const step = tickStep(end - start, 5);
  for (let us = Math.ceil(start / step) * step; us <= end; us += step) context.fillText(time(us), Math.min(x(us), width - 24), height - 4);
  context.textAlign = "start";
}
