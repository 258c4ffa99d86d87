//! Design A beside design B under equal draws: figures of both, and their differences with intervals over frames.
import { byId, make, short } from "./ink.js";
import type { Summary } from "./simulator.js";

/** `whole`: a figure of the run so far, not of one frame; it has no mean over frames. */
const figures: [name: string, unit: string, of: (summary: Summary) => number | null, whole?: true][] = [
  ["Mean code", "DN", (summary) => summary.mean_code_dn],
  ["Saturated pixels", "%", (summary) => 100 * summary.saturated],
  ["Features", "", (summary) => summary.features],
  ["Features in the pose", "", (summary) => summary.tracked_features],
  ["Raw bits", "kbit", (summary) => summary.raw_bits / 1000],
  ["Feature bits", "kbit", (summary) => summary.feature_bits / 1000],
  ["Energy per frame", "µJ", (summary) => summary.energy.total_pj * 1e-6],
  ["Power", "mW", (summary) => summary.energy.power_mw],
  ["Latency", "ms", (summary) => summary.timing.latency_us / 1000],
  ["Path error (ATE) so far", "mm", (summary) => (summary.tracking.ate_m === null ? null : 1000 * summary.tracking.ate_m), true],
];

/** Student's quantile of 97.5 %: a table, and from five degrees on its expansion about the normal one, which is within 0.003. */
function quantile(degrees: number): number {
  return [12.706, 4.303, 3.182, 2.776][degrees - 1] ?? 1.96 + 2.372 / degrees + 2.823 / degrees ** 2 + 2.556 / degrees ** 3;
}

const mean = (values: number[]): number => values.reduce((sum, value) => sum + value, 0) / values.length;

/** Mean of differences and half the width of its interval of 95 %, from the frames' standard deviation; NaN for one frame. */
export function interval(differences: number[]): [mean: number, half: number] {
  const count = differences.length, middle = mean(differences);
  const variance = differences.reduce((sum, value) => sum + (value - middle) ** 2, 0) / (count - 1);
  return [middle, quantile(count - 1) * Math.sqrt(variance / count)];
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
      : "B equals A. Change a control: it changes B. Drag the wiper below the picture.";
    if (!last) {
      byId("compare-frames").textContent = "Design B is simulated beside A. Its first frame takes some seconds: its room is lit anew.";
      return;
    }
    byId("compare-rows").replaceChildren(...figures.map(([name, unit, of, whole]) => {
      const both = (whole ? [last] : this.pairs).map(([one, two]) => [of(one), of(two)])
        .filter((pair): pair is [number, number] => pair[0] !== null && pair[1] !== null);
      const cell = (place: 0 | 1): HTMLElement => make("td", {}, both.length ? short(mean(both.map((pair) => pair[place])), 4) : "–");
      const [a, b] = [cell(0), cell(1)];
      const [middle, half] = both.length ? interval(both.map(([one, two]) => two - one)) : [NaN, NaN];
      const difference = Number.isNaN(middle) ? "–" : `${short(middle)}${Number.isNaN(half) ? "" : ` ± ${short(half, 2)}`}`;
      return make("tr", {}, make("th", { scope: "row" }, unit ? `${name}, ${unit}` : name), a, b, make("td", {}, difference));
    }));
    byId("compare-frames").textContent = this.pairs.length === 1
      ? "Figures of one frame. Play on for means with 95 % intervals."
      : `Means of ${this.pairs.length} frames of one run. ± is the 95 % interval of the mean difference, with frames taken as independent.`;
  }
}
