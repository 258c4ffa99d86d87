//! The part of the core's JavaScript glue that the worker uses.
export default function init(options: { module_or_path: WebAssembly.Module }): Promise<{ memory: WebAssembly.Memory }>;

export class Session {
  constructor(scenario: string);
  beside(scenario: string): Session;
  free(): void;
  step(): void;
  readonly frames: number;
  readonly width: number;
  readonly height: number;
  pixels(): Uint8Array;
  codes(): Uint16Array;
  photons(): Float32Array;
  electrons(): Float32Array;
  features(): Float32Array;
  summary(): string;
  report(): string;
  trajectory(): Float64Array;
  truth(): Float64Array;
  probe(x: number, y: number): string;
  conversion(x: number, y: number): Float64Array;
  waveform(x: number, y: number, format: string): Uint8Array;
  rows(): Float64Array;
  packets(): Float64Array;
  corner(number: number): string;
  noise(): string;
  noise_picture(number: number): Uint8Array;
  transfer(): string;
  scenario(): string;
}
