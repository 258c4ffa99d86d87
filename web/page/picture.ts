//! The sensor's picture with what lies over it: features, the probed pixel, and the seam of a comparison.
import { byId, colours, sheet } from "./ink.js";
import type { FrameAnswer } from "./simulator.js";

export interface Probe { x: number; y: number }

export class Picture {
  private readonly base = byId<HTMLCanvasElement>("picture");
  private readonly over = byId<HTMLCanvasElement>("overlay");
  private readonly frame = byId("frame");
  private readonly store = document.createElement("canvas");
  private readonly other = document.createElement("canvas");
  last: FrameAnswer | undefined;
  lastOther: FrameAnswer | undefined;
  probe: Probe = { x: 0, y: 0 };
  corner = -1;
  showsFeatures = true;
  /** The pixel to which the probe returns when the mouse leaves: the last one that was clicked or set by keys. */
  private held: Probe | undefined;
  /** Share of the width that shows design A; 1 without a comparison. */
  wiper = 1;

  constructor(private readonly moved: (probe: Probe) => void) {
    this.frame.addEventListener("keydown", (event) => this.key(event));
    // The mouse shows every pixel under it; a click keeps one, so that the way to a panel or control does not lose it.
    this.frame.addEventListener("pointerenter", () => { this.held ??= this.probe; });
    this.frame.addEventListener("pointerdown", (event) => this.keep(event));
    this.frame.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) this.keep(event);
      else if (event.pointerType === "mouse") this.point(event);
    });
    this.frame.addEventListener("pointerleave", () => {
      if (this.held) this.moveTo(this.held);
      this.held = undefined;
    });
    new ResizeObserver(() => this.drawOver()).observe(this.frame);
  }

  show(answer: FrameAnswer): void {
    this.last = answer;
    paint(this.store, answer.pixels, answer.width, answer.height);
    if (this.corner >= answer.features.length / 4) this.corner = -1;
    this.draw();
  }

  showOther(answer: FrameAnswer | undefined): void {
    this.lastOther = answer;
    if (answer) paint(this.other, answer.pixels, answer.width, answer.height);
    this.draw();
  }

  /** The picture of design A alone, for the other drawings. */
  get source(): HTMLCanvasElement {
    return this.store;
  }

  draw(): void {
    if (!this.last) return;
    const { width, height } = this.last;
    if (this.base.width !== width || this.base.height !== height) {
      this.base.width = width;
      this.base.height = height;
      this.frame.style.aspectRatio = `${width} / ${height}`;
    }
    const context = this.base.getContext("2d")!;
    context.drawImage(this.store, 0, 0);
    if (this.wiper < 1 && this.lastOther) {
      const from = Math.round(this.wiper * width);
      context.drawImage(this.other, from, 0, width - from, height, from, 0, width - from, height);
    }
    this.drawOver();
  }

  drawOver(): void {
    if (!this.last) return;
    const { context, width, height } = sheet(this.over);
    const scale = width / this.last.width, tint = colours();
    if (this.showsFeatures) this.drawFeatures(context, scale, tint.feature);
    const [x, y] = [(this.probe.x + 0.5) * scale, (this.probe.y + 0.5) * scale], half = Math.max(5, scale);
    for (const [colour, line] of [["#000", 4], ["#fff", 2]] as const) {
      context.strokeStyle = colour;
      context.lineWidth = line;
      context.strokeRect(x - half, y - half, 2 * half, 2 * half);
      context.beginPath();
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
        context.moveTo(x + dx * half, y + dy * half);
        context.lineTo(x + dx * (half + 7), y + dy * (half + 7));
      }
      context.stroke();
    }
    if (this.wiper < 1 && this.lastOther) {
      context.fillStyle = "#fff";
      context.fillRect(this.wiper * width - 1, 0, 2, height);
      label(context, "A", Math.max(14, this.wiper * width - 18), 20);
      label(context, "B", Math.min(width - 14, this.wiper * width + 18), 20);
    }
  }

  private drawFeatures(context: CanvasRenderingContext2D, scale: number, colour: string): void {
    const { features } = this.last!;
    context.lineWidth = 1.5;
    for (let at = 0; at < features.length; at += 4) {
      const [x, y] = [(features[at]! + 0.5) * scale, (features[at + 1]! + 0.5) * scale];
      const chosen = at / 4 === this.corner;
      context.strokeStyle = chosen ? "#fff" : colour;
      context.beginPath();
      context.arc(x, y, chosen ? 3.5 * scale : Math.max(3, 1.5 * scale), 0, 2 * Math.PI);
      context.stroke();
      if (features[at + 3]) {
        context.fillStyle = colour;
        context.beginPath();
        context.arc(x, y, 1.5, 0, 2 * Math.PI);
        context.fill();
      }
    }
  }

  /** The feature next to a pixel, within so many pixels; -1 where there is none. */
  nearest(probe: Probe, reach: number): number {
    const { features } = this.last!;
    let [best, least] = [-1, reach * reach];
    for (let at = 0; at < features.length; at += 4) {
      const distance = (features[at]! - probe.x) ** 2 + (features[at + 1]! - probe.y) ** 2;
      if (distance < least) [best, least] = [at / 4, distance];
    }
    return best;
  }

  /** The feature of the highest score; -1 where there is none. */
  get strongest(): number {
    const features = this.last?.features ?? new Float32Array();
    let [best, most] = [-1, -1];
    for (let at = 0; at < features.length; at += 4) if (features[at + 2]! > most) [best, most] = [at / 4, features[at + 2]!];
    return best;
  }

  private point(event: PointerEvent): void {
    if (!this.last) return;
    const box = this.frame.getBoundingClientRect();
    const place = (share: number, count: number): number => Math.min(count - 1, Math.max(0, Math.floor(share * count)));
    this.moveTo({
      x: place((event.clientX - box.left) / box.width, this.last.width),
      y: place((event.clientY - box.top) / box.height, this.last.height),
    });
  }

  private keep(event: PointerEvent): void {
    this.point(event);
    this.held = this.probe;
  }

  private key(event: KeyboardEvent): void {
    const steps: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const step = steps[event.key];
    if (!step || !this.last) return;
    event.preventDefault();
    const far = event.shiftKey ? 10 : 1, limit = (value: number, count: number): number => Math.min(count - 1, Math.max(0, value));
    this.moveTo({
      x: limit(this.probe.x + far * step[0], this.last.width),
      y: limit(this.probe.y + far * step[1], this.last.height),
    });
    if (this.held) this.held = this.probe;
  }

  moveTo(probe: Probe): void {
    if (probe.x === this.probe.x && probe.y === this.probe.y) return;
    this.probe = probe;
    this.corner = this.last ? this.nearest(probe, 6) : -1;
    this.drawOver();
    this.moved(probe);
  }
}

export function paint(canvas: HTMLCanvasElement, pixels: Uint8Array<ArrayBuffer>, width: number, height: number): void {
  canvas.width = width;
  canvas.height = height;
  canvas.getContext("2d")!.putImageData(new ImageData(new Uint8ClampedArray(pixels.buffer), width, height), 0, 0);
}

function label(context: CanvasRenderingContext2D, text: string, x: number, y: number): void {
  context.font = "600 14px system-ui, sans-serif";
  context.textAlign = "center";
  context.lineWidth = 4;
  context.strokeStyle = "#000";
  context.strokeText(text, x, y);
  context.fillStyle = "#fff";
  context.fillText(text, x, y);
  context.textAlign = "start";
}
