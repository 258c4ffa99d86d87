//! Runs the simulator off the page's thread: one message in, one answer out.
import init, { Session } from "./sensel_web.js";
import type { Summary } from "./simulator.js";

type Request = { id: number; operation: string; args: unknown[] };

const scope = self as unknown as DedicatedWorkerGlobalScope & { senselProgress: (what: string, share: number) => void };
let session: Session | undefined;
let scenario: string | undefined;
let count = 0;
let memory: WebAssembly.Memory | undefined;
// The module comes from the page, which fetches it once for all workers.
let give: (module: WebAssembly.Module) => void;
const ready = new Promise<WebAssembly.Module>((given) => { give = given; })
  .then((module) => init({ module_or_path: module })).then((core) => { memory = core.memory; });
let began = 0, told = 0;

// Progress is said of what takes longer than a fifth of a second, ten times a second at most.
scope.senselProgress = (what, share) => {
  const now = performance.now();
  if (now - began < 200 || now - told < 100) return;
  told = now;
  scope.postMessage({ what, share });
};

const running = (): Session => {
  if (!session) throw new Error("no scenario was started");
  return session;
};

/** A run of a scenario. What it has in common with the run before is taken over: the scene, its light, the motion. */
function begin(text: string): Session {
  const next = session ? session.beside(text) : new Session(text);
  session?.free();
  [session, scenario, count] = [next, text, 0];
  return next;
}

/** The next frame; after a run's last one its first. So a page that plays for hours holds one run's records. */
function step(): unknown {
  const started = performance.now(), run = count < running().frames ? running() : begin(scenario!);
  run.step();
  count += 1;
  const milliseconds = performance.now() - started;
  return { width: run.width, height: run.height, pixels: run.pixels(), codes: run.codes(), features: run.features(),
    summary: JSON.parse(run.summary()), milliseconds };
}

/** One frame of each setting, and its codes' distance from those of the last, which is the best. */
function accuracy(settings: [string, string][]): unknown {
  const measured = (scenario: string): { ms: number; codes: Uint16Array; render_variance_ratio: number | null; sensor_ms: number } => {
    const one = running().beside(scenario);
    const started = performance.now();
    one.step();
    const ms = performance.now() - started, codes = one.codes();
    const { render_variance_ratio, stages_ms } = JSON.parse(one.summary()) as Pick<Summary, "render_variance_ratio" | "stages_ms">;
    one.free();
    return { ms, codes, render_variance_ratio, sensor_ms: new Map(stages_ms).get("sensor")! };
  };
  // The engine compiles what runs often once more, for speed. Until then the first settings would seem slower than they are.
  let slowest_ms = 0, last_ms = Infinity;
  for (let frame = 0; frame < 24 && last_ms > slowest_ms / 2; frame += 1) {
    scope.senselProgress("warming up", 0);
    last_ms = measured(settings[0]![1]).sensor_ms;
    slowest_ms = Math.max(slowest_ms, last_ms);
  }
  const taken = settings.map(([name, scenario], place) => {
    scope.senselProgress(name, place / settings.length);
    return { name, ...measured(scenario) };
  });
  const best = taken[taken.length - 1]!.codes;
  return taken.map(({ codes, ...row }) => {
    let [sum, max_dn] = [0, 0];
    codes.forEach((code, at) => {
      const distance = Math.abs(code - best[at]!);
      sum += distance * distance;
      if (distance > max_dn) max_dn = distance;
    });
    return { ...row, rms_dn: Math.sqrt(sum / codes.length), max_dn };
  });
}

const operations: Record<string, (...args: never[]) => unknown> = {
  start: (text: string) => {
    begin(text);
    return step();
  },
  step,
  probe: (x: number, y: number) => JSON.parse(running().probe(x, y)),
  probes: (places: [number, number][]) => places.map(([x, y]) => JSON.parse(running().probe(x, y))),
  conversion: (x: number, y: number) => running().conversion(x, y),
  rows: () => running().rows(),
  packets: () => running().packets(),
  corner: (number: number) => JSON.parse(running().corner(number)),
  noise: () => JSON.parse(running().noise()),
  noisePicture: (number: number) => running().noise_picture(number),
  accuracy,
  transfer: () => JSON.parse(running().transfer()),
  trajectory: () => running().trajectory(),
  truth: () => running().truth(),
  report: () => running().report(),
  waveform: (x: number, y: number, format: string) => running().waveform(x, y, format),
  scenario: () => running().scenario(),
  memory: () => memory!.buffer.byteLength,
};

/** The buffers of an answer, which move instead of being copied. */
function buffers(value: unknown): ArrayBuffer[] {
  if (ArrayBuffer.isView(value)) return [value.buffer as ArrayBuffer];
  if (value === null || typeof value !== "object") return [];
  return Object.values(value).filter(ArrayBuffer.isView).map((view) => view.buffer as ArrayBuffer);
}

scope.onmessage = async ({ data }: MessageEvent<Request | { module: WebAssembly.Module }>) => {
  if ("module" in data) {
    give(data.module);
    return;
  }
  try {
    await ready;
    began = performance.now();
    const value = operations[data.operation]!(...(data.args as never[]));
    scope.postMessage({ id: data.id, value }, [...new Set(buffers(value))]);
  } catch (error) {
    scope.postMessage({ id: data.id, error: String((error as Error).message ?? error) });
  }
};
