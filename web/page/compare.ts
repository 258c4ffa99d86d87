//! Design A beside design B under equal draws: figures of both, and their differences with intervals over frames.
import { byId, make, short } from "./ink.js";
import type { Summary } from "./simulator.js";

const figures: [name: string, unit: string, of: (summary: Summary) => number | null][] = [
  ["Mean code", "DN", (summary) => summary.mean_code_dn],
  ["Saturated pixels", "%", (summary) => 100 * summary.saturated],
  ["Features", "", (summary) => summary.features],
  ["Features in the pose", "", (summary) => summary.tracked_features],
  ["Raw bits", "kbit", (summary) => summary.raw_bits / 1000],
  ["Feature bits", "kbit", (summary) => summary.feature_bits / 1000],
  ["Energy a frame", "µJ", (summary) => summary.energy.total_pj * 1e-6],
  ["Power", "mW", (summary) => summary.energy.power_mw],
  ["Latency", "ms", (summary) => summary.timing.latency_us / 1000],
  ["ATE", "mm", (summary) => (summary.tracking.ate_m === null ? null : 1000 * summary.tracking.ate_m)],
];

/** Mean of differences and half the width of its interval of 95 %, from the frames' standard deviation; NaN for one frame. */
export function interval(differences: number[]): [mean: number, half: number] {
  const count = differences.length, mean = differences.reduce((sum, value) => sum + value, 0) / count;
  const variance = differences.reduce((sum, value) => sum + (value - mean) ** 2, 0) / (count - 1);
  return [mean, 1.96 * Math.sqrt(variance / count)];
}

export class Compare {
  private pairs: [Summary, Summary][] = [];

  clear(): void {
    this.pairs = [];
  }

  add(a: Summary, b: Summary): void {
    if (a.frame !== b.frame) return;
    if (a.frame === 0) this.clear();
    this.pairs.push([a, b]);
  }

  show(changed: string[]): void {
    const last = this.pairs[this.pairs.length - 1];
    byId("compare-text").textContent = changed.length
      ? `B differs from A in: ${changed.join(", ")}. Both have the same draws, so the difference is the design's.`
      : "B equals A. Change a control: it changes B. Drag the wiper over the picture.";
    if (!last) return;
    byId("compare-rows").replaceChildren(...figures.map(([name, unit, of]) => {
      const [a, b] = [of(last[0]), of(last[1])];
      const both = this.pairs.map(([one, two]) => [of(one), of(two)] as const).filter(([one, two]) => one !== null && two !== null);
      const cell = (value: number | null): HTMLElement => make("td", {}, value === null ? "–" : short(value, 4));
      const [mean, half] = both.length ? interval(both.map(([one, two]) => two! - one!)) : [NaN, NaN];
      const difference = Number.isNaN(mean) ? "–" : `${short(mean)}${Number.isNaN(half) ? "" : ` ± ${short(half, 2)}`}`;
      return make("tr", {}, make("th", { scope: "row" }, unit ? `${name}, ${unit}` : name), cell(a), cell(b), make("td", {}, difference));
    }));
    byId("compare-frames").textContent = this.pairs.length === 1
      ? "Differences of one frame. Play on for means with 95 % intervals."
      : `Differences: mean of ${this.pairs.length} frames, ± 95 % interval.`;
  }
}
