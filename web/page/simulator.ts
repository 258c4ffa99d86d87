//! The simulator in its worker: one request at a time, answers as promises, progress of what takes long, and an end at once.

export interface FrameAnswer {
  width: number;
  height: number;
  pixels: Uint8Array<ArrayBuffer>;
  codes: Uint16Array;
  features: Float32Array;
  summary: Summary;
  milliseconds: number;
}

export interface Phase { lane: string; name: string; start_us: number; end_us: number }

/** What the core says of a frame and of the run so far; keys as in its report. */
export interface Summary {
  frame: number; t_s: number; features: number; mean_code_dn: number; mean_photons: number; saturated: number;
  raw_bits: number; feature_bits: number; packet_bytes: number; cameras: number;
  kept: string[]; omitted: [string, string][]; present: string[];
  hashes: Record<string, string>; has_pose: boolean; keyframe: boolean; tracked_features: number;
  exposure_us: number; exposure_lines: number; line_us: number; frame_us: number; fps: number; hts: number; vts: number; rolling: boolean;
  timing: { line: Phase[]; frame: Phase[]; latency_us: number; feature_latency_us: number | null;
    extractor: { required: number; available: number } | null };
  bandwidth: { raw_bits_per_frame: number; container_bits_per_frame: number; feature_bits_per_frame: number; link_bits_per_s: number;
    reduction: number | null; link_utilisation: number; link_utilisation_burst: number };
  energy: { blocks: Record<string, number>; blocks_interval: Record<string, { low_pj: number; high_pj: number }>;
    rails: Record<string, number>; total_pj: number; power_mw: number; static_mw: number; pj_per_pixel: number; technology: string;
    deciders: { name: string; energy_share: number; variance_share: number }[] };
  tracking: { ate_m: number | null; rpe_m: number | null; jitter_frame_m: number | null; jitter_d2_m: number | null;
    tracked_fraction: number };
  extractor: { corners: number; unselected: number; lost: number; stalled_clk: number };
  render_variance_ratio: number | null; stages_ms: [string, number][]; warnings: string[];
  not_measurable: Record<string, string>; version: string; config_hash: string;
}

export type Operation = "start" | "step" | "probe" | "probes" | "conversion" | "rows" | "packets" | "corner" | "noise" | "noisePicture"
  | "transfer" | "accuracy" | "trajectory" | "truth" | "report" | "waveform" | "scenario" | "memory";

/** The run was ended by a person. */
export class Cancelled extends Error {}

interface Waiting { resolve: (value: never) => void; reject: (error: Error) => void; operation: Operation }

let compiled: Promise<WebAssembly.Module> | undefined;

/** The module, fetched and compiled once for all workers. */
function moduleOnce(): Promise<WebAssembly.Module> {
  compiled ??= WebAssembly.compileStreaming(fetch("sensel_web_bg.wasm"));
  return compiled;
}

export class Simulator {
  private worker: Worker | undefined;
  private serial = 0;
  private readonly waiting = new Map<number, Waiting>();

  constructor(private readonly progress: (what: string, share: number) => void) {}

  /** Asks for something; the answer comes when the requests before it are done. */
  ask<T>(operation: Operation, ...args: unknown[]): Promise<T> {
    const worker = this.worker ?? this.start();
    this.serial += 1;
    const id = this.serial;
    return new Promise<T>((resolve, reject) => {
      this.waiting.set(id, { resolve: resolve as (value: never) => void, reject, operation });
      worker.postMessage({ id, operation, args });
    });
  }

  /** How many requests have no answer yet. */
  get busy(): number {
    return this.waiting.size;
  }

  /** Ends whatever runs, at once. The next request begins in a new worker, without a run. */
  cancel(): void {
    this.worker?.terminate();
    this.worker = undefined;
    for (const { reject } of this.waiting.values()) reject(new Cancelled("stopped"));
    this.waiting.clear();
  }

  /** A worker, which loads its own code while the module is still on its way. */
  start(): Worker {
    const worker = new Worker("worker.js", { type: "module" });
    worker.onmessage = ({ data }) => this.answered(data);
    const fail = (message: string): void => {
      for (const { reject } of this.waiting.values()) reject(new Error(message));
      this.waiting.clear();
    };
    worker.onerror = (event) => fail(event.message || "the worker failed");
    moduleOnce().then((module) => worker.postMessage({ module }),
      (error: Error) => fail(`the simulator could not be loaded: ${error.message}`));
    this.worker = worker;
    return worker;
  }

  private answered(data: { id: number; value?: never; error?: string; what?: string; share?: number }): void {
    if (data.what !== undefined) {
      this.progress(data.what, data.share ?? 0);
      return;
    }
    const waiting = this.waiting.get(data.id);
    this.waiting.delete(data.id);
    if (data.error !== undefined) waiting?.reject(new Error(data.error));
    else waiting?.resolve(data.value as never);
  }
}
