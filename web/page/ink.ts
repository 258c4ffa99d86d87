//! Colours and lines of the page's own drawings: canvases that follow the theme and the screen's density.

const names = ["ink", "paper", "soft", "line", "accent", "panel", "ramp", "input", "bit", "count", "expose", "store", "convert", "send",
  "feature", "grid"] as const;
export type Colour = (typeof names)[number];

/** The theme's colours as they stand now. */
export function colours(): Record<Colour, string> {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()])) as Record<Colour, string>;
}

export interface Sheet { context: CanvasRenderingContext2D; width: number; height: number }

/** A canvas cleared and sized to its box, in CSS pixels. */
export function sheet(canvas: HTMLCanvasElement): Sheet {
  const density = Math.min(3, devicePixelRatio || 1);
  const { clientWidth: width, clientHeight: height } = canvas;
  const [across, down] = [Math.round(width * density), Math.round(height * density)];
  if (canvas.width !== across || canvas.height !== down) {
    canvas.width = across;
    canvas.height = down;
  }
  const context = canvas.getContext("2d")!;
  context.setTransform(density, 0, 0, density, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  context.lineJoin = "round";
  return { context, width, height };
}

/** A round step for about so many ticks over a span. */
export function tickStep(span: number, count: number): number {
  const rough = span / Math.max(1, count), power = 10 ** Math.floor(Math.log10(rough));
  return power * ([1, 2, 5, 10].find((factor) => factor * power >= rough) ?? 10);
}

/** A number with about three digits and no exponent where a person would write none. */
export function short(value: number, digits = 3): string {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e7 || (size > 0 && size < 1e-4)) return value.toExponential(digits - 1);
  if (size >= 1000) return Math.round(value).toLocaleString("en");
  return Number(value.toPrecision(digits)).toLocaleString("en", { maximumFractionDigits: 6 });
}

/** A time in us with the unit that suits it. */
export function time(us: number): string {
  if (Math.abs(us) >= 1000) return `${short(us / 1000)} ms`;
  return `${short(us)} µs`;
}

/** An energy in pJ with the unit that suits it. */
export function energy(pj: number): string {
  if (pj >= 1e6) return `${short(pj * 1e-6)} µJ`;
  if (pj >= 1e3) return `${short(pj * 1e-3)} nJ`;
  return `${short(pj)} pJ`;
}

/** Bits with the unit that suits them. */
export function bits(count: number): string {
  if (count >= 1e6) return `${short(count * 1e-6)} Mbit`;
  if (count >= 1e3) return `${short(count * 1e-3)} kbit`;
  return `${short(count)} bit`;
}

/** An element with its attributes and content. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Record<string, string> = {}, ...content: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...content);
  return element;
}

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`no element '${id}'`);
  return found as T;
}

/** Whether a person asked for less motion. */
export const calm = (): boolean => matchMedia("(prefers-reduced-motion: reduce)").matches;
