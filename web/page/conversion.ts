//! One pixel from photons to its code: figures in a chain, and its conversion by the clock, scrubbed by hand.
import { byId, calm, colours, make, sheet, short, tickStep } from "./ink.js";

export interface Probed {
  x: number; y: number; photons: number; electrons: number; signal_uv: number; reset_uv: number | null; code: number; bits: number;
  black_level_dn: number; lsb_uv: number; conversion_gain_uv_per_e: number; quantum_efficiency: number; full_well_e: number;
  code_max: number;
}

const fields = 8;
const phases = ["waits", "lets the reset level settle", "converts the reset level", "lets the signal settle", "converts the signal",
  "waits for the next row"];
const phaseNames = ["idle", "settle reset", "ramp reset", "settle signal", "ramp signal", "blank"];

/** The waveforms of a conversion, one row of numbers for each instant at which something changes. */
class Trace {
  constructor(readonly table: Float64Array) {}
  get length(): number { return this.table.length / fields; }
  get end(): number { return this.length ? this.table[(this.length - 1) * fields]! : 0; }
  at(row: number, field: number): number { return this.table[row * fields + field]!; }
  /** The last instant at or before a time. */
  rowAt(us: number): number {
    let [low, high] = [0, this.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.at(middle, 0) <= us) low = middle;
      else high = middle - 1;
    }
    return low;
  }
}

export class Conversion {
  private trace = new Trace(new Float64Array());
  private probed: Probed | undefined;
  private readonly canvas = byId<HTMLCanvasElement>("scope");
  private readonly scrub = byId<HTMLInputElement>("scrub");
  private running = 0;

  constructor() {
    this.scrub.addEventListener("input", () => { this.stop(); this.draw(); });
    this.canvas.addEventListener("pointerdown", (event) => this.point(event));
    this.canvas.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.point(event); });
    byId("run-conversion").addEventListener("click", () => (this.running ? this.stop() : this.run()));
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  showProbe(probed: Probed): void {
    this.probed = probed;
    const volts = probed.reset_uv === null ? probed.signal_uv : probed.signal_uv - probed.reset_uv;
    const steps: [string, string, string][] = [
      ["Photons", short(probed.photons, 4), "mean over the exposure"],
      ["Electrons", short(probed.electrons, 4), `QE × fill ${short(probed.quantum_efficiency, 2)}, counted one by one`],
      ["Microvolts", short(volts, 4), `${short(probed.conversion_gain_uv_per_e)} µV per electron, with noise`],
      ["Code", String(probed.code), `of 0 to ${probed.code_max}; steps of ${short(probed.lsb_uv)} µV`],
    ];
    byId("chain").replaceChildren(...steps.map(([name, value, note]) => {
      const entry = make("li", {}, make("span", { class: "name" }, name), make("strong", {}, value), make("span", { class: "note" }, note));
      entry.dataset.figure = name.toLowerCase();
      return entry;
    }));
    byId("probe-place").textContent = `column ${probed.x}, row ${probed.y}; click in the picture for another`;
  }

  showTrace(table: Float64Array): void {
    this.trace = new Trace(table);
    byId("scope-error").textContent = "";
    this.draw();
  }

  showError(message: string): void {
    this.trace = new Trace(new Float64Array());
    byId("scope-error").textContent = message;
    this.draw();
  }

  private get now(): number { return (Number(this.scrub.value) / Number(this.scrub.max)) * this.trace.end; }

  private point(event: PointerEvent): void {
    this.stop();
    const box = this.canvas.getBoundingClientRect(), { left, right } = margins;
    const share = (event.clientX - box.left - left) / (box.width - left - right);
    this.scrub.value = String(Math.round(Math.min(1, Math.max(0, share)) * Number(this.scrub.max)));
    this.draw();
  }

  private run(): void {
    if (calm()) {
      this.scrub.value = this.scrub.max;
      this.draw();
      return;
    }
    if (Number(this.scrub.value) >= Number(this.scrub.max)) this.scrub.value = "0";
    byId("run-conversion").textContent = "Pause conversion";
    let before = performance.now();
    const tick = (now: number): void => {
      // A line takes six seconds here, about three hundred thousand times as long as on the sensor.
      this.scrub.value = String(Number(this.scrub.value) + ((now - before) / 6000) * Number(this.scrub.max));
      before = now;
      this.draw();
      if (Number(this.scrub.value) >= Number(this.scrub.max)) this.stop();
      else this.running = requestAnimationFrame(tick);
    };
    this.running = requestAnimationFrame(tick);
  }

  private stop(): void {
    cancelAnimationFrame(this.running);
    this.running = 0;
    byId("run-conversion").textContent = "Run conversion";
  }

  draw(): void {
    if (this.canvas.clientWidth === 0) return;
    const { context, width, height } = sheet(this.canvas), { trace } = this;
    if (trace.length === 0) {
      byId("scope-text").textContent = "";
      return;
    }
    const tint = colours(), { left, right, top, bottom } = margins;
    const inner = width - left - right, x = (us: number): number => left + (us / trace.end) * inner;
    const analog = { top, height: (height - top - bottom) * 0.52 };
    let most = 1;
    for (let row = 0; row < trace.length; row += 1) most = Math.max(most, trace.at(row, 2) || 0, trace.at(row, 3) || 0);
    const uv = (value: number): number => analog.top + analog.height * (1 - value / (1.05 * most));
    this.drawPhases(context, x, height - bottom, tint);
    context.fillStyle = tint.soft;
    context.strokeStyle = tint.grid;
    context.lineWidth = 1;
    const step = tickStep(most, 4);
    for (let value = 0; value <= most; value += step) {
      context.beginPath();
      context.moveTo(left, uv(value));
      context.lineTo(width - right, uv(value));
      context.stroke();
      context.textAlign = "right";
      context.fillText(short(value / 1000), left - 6, uv(value) + 4);
    }
    context.fillText("mV", left - 6, analog.top - 6);
    this.line(context, x, 3, uv, tint.input, 2);
    this.line(context, x, 2, uv, tint.ramp, 2);
    const lane = (height - top - bottom) * 0.12, from = analog.top + analog.height + 14;
    const bit = (value: number): number => from + lane * (1 - value) * 0.8;
    this.line(context, x, 4, bit, tint.bit, 2);
    const counts = { top: from + lane + 12, height: height - bottom - (from + lane + 12) - 4 };
    let [low, high] = [0, 1];
    for (let row = 0; row < trace.length; row += 1) {
      const value = trace.at(row, 5);
      if (value < low) low = value;
      if (value > high) high = value;
    }
    const count = (value: number): number => counts.top + counts.height * (1 - (value - low) / (high - low));
    this.line(context, x, 5, count, tint.count, 2);
    context.textAlign = "right";
    context.fillStyle = tint.soft;
    context.fillText("bit", left - 6, from + lane * 0.5 + 4);
    context.fillText(short(high), left - 6, counts.top + 8);
    context.fillText(short(low), left - 6, counts.top + counts.height);
    context.fillText("count", left - 6, counts.top + counts.height / 2 + 4);
    context.textAlign = "center";
    const step_us = tickStep(trace.end, 6);
    for (let us = 0; us <= trace.end; us += step_us) context.fillText(us === 0 ? "0 µs" : short(us), x(us), height - 4);
    context.textAlign = "start";
    this.drawNow(context, x, [uv, bit, count], height, tint);
  }

  private drawPhases(context: CanvasRenderingContext2D, x: (us: number) => number, floor: number, tint: ReturnType<typeof colours>): void {
    const { trace } = this;
    let start = 0;
    for (let row = 1; row <= trace.length; row += 1) {
      if (row < trace.length && trace.at(row, 1) === trace.at(start, 1)) continue;
      const phase = trace.at(start, 1), from = x(trace.at(start, 0));
      const until = x(row < trace.length ? trace.at(row, 0) : trace.end);
      context.fillStyle = phase === 2 || phase === 4 ? tint.panel : "transparent";
      context.fillRect(from, 0, until - from, floor);
      context.fillStyle = tint.soft;
      const name = phaseNames[phase] ?? "";
      if (context.measureText(name).width < until - from - 8) context.fillText(name, from + 5, 13);
      start = row;
    }
  }

  private line(
    context: CanvasRenderingContext2D, x: (us: number) => number, field: number, y: (value: number) => number, colour: string,
    width: number,
  ): void {
    const { trace } = this;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    let open = false;
    for (let row = 0; row < trace.length; row += 1) {
      const value = trace.at(row, field), at = x(trace.at(row, 0));
      const until = x(row + 1 < trace.length ? trace.at(row + 1, 0) : trace.end);
      if (Number.isNaN(value)) {
        open = false;
        continue;
      }
      if (open) context.lineTo(at, y(value));
      else context.moveTo(at, y(value));
      context.lineTo(until, y(value));
      open = true;
    }
    context.stroke();
  }

  private drawNow(
    context: CanvasRenderingContext2D, x: (us: number) => number, ys: ((value: number) => number)[], height: number,
    tint: ReturnType<typeof colours>,
  ): void {
    const { trace } = this, us = this.now, row = trace.rowAt(us);
    context.strokeStyle = tint.ink;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x(us), 0);
    context.lineTo(x(us), height - margins.bottom + 2);
    context.stroke();
    const dots: [number, (value: number) => number, string][] =
      [[2, ys[0]!, tint.ramp], [3, ys[0]!, tint.input], [4, ys[1]!, tint.bit], [5, ys[2]!, tint.count]];
    for (const [field, y, colour] of dots) {
      const value = trace.at(row, field);
      if (Number.isNaN(value)) continue;
      context.fillStyle = colour;
      context.beginPath();
      context.arc(x(us), y(value), 4, 0, 2 * Math.PI);
      context.fill();
    }
    const [phase, ramp, input, bit, counter, latched] = [1, 2, 3, 4, 5, 6].map((field) => trace.at(row, field));
    const code = trace.at(trace.length - 1, 7);
    const compares = phase === 2 || phase === 4;
    const said = compares
      ? `The ramp is at ${short(ramp! / 1000, 4)} mV, the pixel at ${short(input! / 1000, 4)} mV: ` +
        (bit ? `the comparator has flipped and the count stands at ${counter}.` : `the counter runs, ${counter} so far.`)
      : `The counter stands at ${counter}.`;
    const latch = row === trace.length - 1 || latched ? ` The latch holds code ${Number.isNaN(code) ? this.probed?.code : code}.` : "";
    byId("scope-text").textContent = `${short(us, 4)} µs: the column ${phases[phase!] ?? "waits"}. ${said}${latch}`;
    this.scrub.setAttribute("aria-valuetext", `${short(us, 4)} microseconds, counter ${counter}`);
  }
}

const margins = { left: 44, right: 12, top: 30, bottom: 22 };
