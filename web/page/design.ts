//! A sensor design as the page's controls state it: ranges, texts, the address, and the scenario that the program reads.

/** How a control's value moves along its slider. */
export type Scale = "linear" | "log" | "choice";

export interface Control {
  id: string;
  /** Key of the scenario, so that the core's errors find their control. */
  keys: string[];
  group: string;
  label: string;
  unit: string;
  scale: Scale;
  min?: number;
  max?: number;
  step?: number;
  choices?: [value: string, name: string][];
  help: string;
  /** Whether the control acts under this design. */
  when?: (design: Design) => boolean;
}

export type Design = Record<string, string>;

export const controls: Control[] = [
  { id: "lux", keys: ["scene.illuminance_lux"], group: "Scene", label: "Light", unit: "lux", scale: "log", min: 0.001, max: 100000,
    help: "Illuminance at the camera. Starlight is 0.001, a street lamp 10, an office 500, the sun 100,000 lux." },
  { id: "scene", keys: ["scene.generator", "scene.target"], group: "Scene", label: "Scene", unit: "", scale: "choice",
    choices: [["columns", "Columns"], ["box", "Box room"], ["checkerboard", "Checkerboard"], ["slanted_edge", "Slanted edge"],
      ["grey_wedge", "Grey wedge"]],
    help: "What the camera looks at: a room with striped columns, a room with boxes, or a test chart. Made in your browser." },
  { id: "motion", keys: ["motion.kind"], group: "Scene", label: "Motion", unit: "", scale: "choice",
    choices: [["still", "Still"], ["sway", "Sway"], ["walk", "Walk"], ["spin", "Turn"]],
    help: "How the camera moves. A fast turn shows what the shutter does." },
  { id: "rate", keys: ["motion.rate_deg_per_s"], group: "Scene", label: "Turning rate", unit: "°/s", scale: "linear", min: -720, max: 720,
    step: 10, when: (design) => design.motion === "spin", help: "Angular rate of the camera, to the right." },
  { id: "lens", keys: ["optics.preset"], group: "Lens", label: "Lens", unit: "", scale: "choice",
    choices: [["pinhole_90", "Pinhole 90°"], ["radtan_90", "Barrel 90°"], ["kb4_120", "Fisheye 120°"], ["kb4_190", "Fisheye 190°"]],
    help: "The mapping from angle to image height. A fisheye shows more and shrinks the edge." },
  { id: "fnumber", keys: ["optics.f_number"], group: "Lens", label: "Aperture", unit: "f/", scale: "log", min: 1.2, max: 16,
    help: "Focal length over pupil diameter. Twice the number passes a quarter of the light." },
  { id: "exposure", keys: ["sensor.readout.exposure_us"], group: "Readout", label: "Exposure", unit: "ms", scale: "log", min: 0.05, max: 30,
    help: "Time for which each pixel gathers light. Longer gathers more photons and blurs motion." },
  { id: "shutter", keys: ["sensor.readout.shutter", "sensor.pixel.type"], group: "Readout", label: "Shutter", unit: "", scale: "choice",
    choices: [["global", "Global"], ["rolling", "Rolling"]],
    help: "Global: all rows gather light at the same time and wait for readout. Rolling: each row starts one line later." },
  { id: "hts", keys: ["sensor.readout.hts", "--waves: a line"], group: "Readout", label: "Line length", unit: "clocks", scale: "log",
    min: 700, max: 6000, step: 1,
    help: "Pixel clocks (48 MHz) from row to row. A longer line skews a rolling picture more and leaves time for deeper ramps." },
  { id: "well", keys: ["sensor.pixel.full_well_e"], group: "Pixel", label: "Full well", unit: "e-", scale: "log", min: 500, max: 10000,
    help: "Electrons that a pixel holds. What comes beyond is lost: the picture clips." },
  { id: "read", keys: ["sensor.pixel.read_noise_uv"], group: "Pixel", label: "Read noise", unit: "µV", scale: "linear", min: 0, max: 1000,
    step: 10, help: "Noise of source follower and column after double sampling. 10 µV are one electron here." },
  { id: "kelvin", keys: ["sensor.temperature_k"], group: "Pixel", label: "Temperature", unit: "K", scale: "linear", min: 260, max: 380,
    step: 1, help: "Of the die. Dark current doubles every 8 K." },
  { id: "bits", keys: ["sensor.adc.bits"], group: "Converter", label: "Depth", unit: "bit", scale: "linear", min: 1, max: 14, step: 1,
    help: "Bits of a code. Each bit more doubles the counts of the ramp, and its time." },
  { id: "gain", keys: ["sensor.adc.gain"], group: "Converter", label: "Gain", unit: "×", scale: "log", min: 1, max: 16,
    help: "A ramp of less slope: smaller steps, and a smaller range." },
  { id: "ramp", keys: ["sensor.adc.ramp", "sensor.adc.ramp_points"], group: "Converter", label: "Ramp", unit: "", scale: "choice",
    choices: [["linear", "Linear"], ["piecewise", "Fine in the dark"]],
    help: "Linear: equal steps. Fine in the dark: half of the codes for the lowest fifth of the range." },
  { id: "cds", keys: ["sensor.adc.cds"], group: "Converter", label: "Double sampling (CDS)", unit: "", scale: "choice",
    choices: [["none", "None"], ["analog", "Analog"], ["digital", "Digital"]],
    help: "The reset level is subtracted from the signal. That removes reset noise and the columns' offsets." },
  { id: "threshold", keys: ["compute.threshold"], group: "Extractor", label: "FAST threshold", unit: "DN", scale: "linear", min: 2, max: 80,
    step: 1, help: "A corner needs nine neighbours in an arc that all differ from its centre by more than this. DN, digital number: " +
      "a step of the code." },
  { id: "word", keys: ["compute.pipeline_bits"], group: "Extractor", label: "Word of a pixel", unit: "bit", scale: "linear", min: 8,
    max: 12, step: 1, help: "What the extractor computes with. Longer words cost memory and energy; the threshold is scaled with the word." },
  { id: "descriptor", keys: ["compute.descriptor_bits"], group: "Extractor", label: "Descriptor", unit: "bit", scale: "choice",
    choices: [["64", "64 bit"], ["128", "128 bit"], ["192", "192 bit"], ["256", "256 bit"]],
    help: "Comparisons that describe a corner. Fewer save bits on the link; more tell alike corners apart." },
  { id: "link", keys: ["link.mode"], group: "Extractor", label: "Link carries", unit: "", scale: "choice",
    choices: [["both", "Both"], ["frames", "Frames"], ["features", "Features"]],
    help: "What leaves the chip: rows of codes, feature packets, or both." },
  { id: "rig", keys: ["rig.baseline_mm"], group: "Run", label: "Cameras", unit: "", scale: "choice",
    choices: [["0.0", "One"], ["65.0", "Two, 65 mm"]], help: "Two cameras give the tracker its scale at once. They take twice the time." },
  { id: "size", keys: ["sensor.width", "sensor.height"], group: "Run", label: "Pixels", unit: "", scale: "choice",
    choices: [["160", "160 × 120"], ["320", "320 × 240"], ["640", "640 × 480"]], help: "Rows and columns of the array." },
  { id: "rays", keys: ["run.samples_per_pixel"], group: "Run", label: "Rays", unit: "per pixel", scale: "log", min: 1, max: 64, step: 1,
    help: "Rays of the render a pixel. More take longer and leave less error of the render itself." },
];

export const defaults: Design = {
  lux: "800", scene: "columns", motion: "sway", rate: "180", lens: "pinhole_90", fnumber: "2", exposure: "6", shutter: "global",
  hts: "928", well: "10000", read: "100", kelvin: "300", bits: "10", gain: "1", ramp: "linear", cds: "digital", threshold: "20",
  word: "8", descriptor: "256", link: "both",
  rig: "0.0", size: "320", rays: "1", off: "", seed: "1", frames: "300",
};

export const control = (id: string): Control => {
  const found = controls.find((one) => one.id === id);
  if (!found) throw new Error(`no control '${id}'`);
  return found;
};

/** A control's value in words: the name of a choice, or the number with its unit. */
export function named(id: string, value: string): string {
  const one = control(id);
  return one.choices?.find(([key]) => key === value)?.[1] ?? `${value} ${one.unit}`.trim();
}

/** Which control a message of the core is about; none where it names no key of one. */
export function controlOf(message: string): string | undefined {
  const places = controls.flatMap((one) => one.keys.map((key) => ({ id: one.id, at: message.indexOf(`${key} = `) })));
  return places.filter((place) => place.at >= 0).sort((a, b) => a.at - b.at)[0]?.id;
}

/** A number as people write it: with its unit or without, "10,000" as the page itself prints it, "12,5" with a decimal comma. */
function typedNumber(one: Control, text: string): number {
  let bare = text.trim().toLowerCase();
  const unit = one.unit.toLowerCase().replace("µ", "μ");
  if (unit !== "" && bare.replace("µ", "μ").endsWith(unit)) bare = bare.slice(0, -unit.length).trim();
  else if (unit !== "" && bare.startsWith(unit)) bare = bare.slice(unit.length).trim();
  if (bare === "") return NaN;
  return Number(/^-?[1-9]\d{0,2}(,\d{3})+(\.\d*)?$/.test(bare) ? bare.replaceAll(",", "") : bare.replace(",", "."));
}

/** What may be typed, as a sentence. */
export const range = ({ min, max, unit, choices }: Control): string => (choices
  ? `Choose one of ${choices.map(([, name]) => name).join(", ")}.` : `Type a number from ${min} to ${max}${unit ? ` ${unit}` : ""}.`);

/** A value as the control allows it, or nothing. */
export function accepted(one: Control, text: string): string | undefined {
  if (one.scale === "choice") return one.choices?.some(([value]) => value === text) ? text : undefined;
  const number = typedNumber(one, text);
  if (!Number.isFinite(number)) return undefined;
  if (number < one.min! || number > one.max!) return undefined;
  const stepped = one.step ? Math.round(number / one.step) * one.step : number;
  return String(Number(stepped.toPrecision(4)));
}

/** Slider position, 0 to 1000, of a value. */
export function toSlider(one: Control, value: string): number {
  const number = Number(value), { min = 0, max = 1 } = one;
  const share = one.scale === "log" ? Math.log(number / min) / Math.log(max / min) : (number - min) / (max - min);
  return Math.round(1000 * share);
}

/** Value of a slider position. */
export function fromSlider(one: Control, position: number): string {
  const share = position / 1000, { min = 0, max = 1 } = one;
  const value = one.scale === "log" ? min * (max / min) ** share : min + share * (max - min);
  const rounded = one.step ? Math.round(value / one.step) * one.step : Number(value.toPrecision(2));
  return String(Math.min(max, Math.max(min, Number(rounded.toPrecision(4)))));
}

/** Text of a design's part of the address: what differs from the defaults. */
export function toAddress(design: Design, more: Record<string, string>): string {
  const changed = Object.entries(design).filter(([key, value]) => defaults[key] !== value);
  return new URLSearchParams([...changed, ...Object.entries(more)]).toString();
}

/** The design of an address. Values that no control allows are left at their defaults, and `refused` says so. */
export function fromAddress(text: string): { design: Design; more: URLSearchParams; refused: string[] } {
  const more = new URLSearchParams(text), design = { ...defaults }, refused: string[] = [];
  for (const one of controls) {
    const value = more.get(one.id);
    const allowed = value === null ? undefined : accepted(one, value);
    if (allowed !== undefined) design[one.id] = allowed;
    else if (value !== null) {
      refused.push(`${one.label}: the address has "${value}"; ${named(one.id, defaults[one.id]!)} is used. ${range(one)}`);
    }
  }
  const off = more.get("off") ?? "";
  if (/^[a-z_,]*$/.test(off)) design.off = off;
  const seed = more.get("seed") ?? "1";
  if (/^\d{1,9}$/.test(seed)) design.seed = seed;
  const frames = more.get("frames") ?? "300";
  if (/^[1-9]\d{0,2}$/.test(frames)) design.frames = frames;
  return { design, more, refused };
}

/** Rooms, and where the camera stands in them. */
const rooms: Record<string, string> = { columns: "[0.0, 1.5, 0.3]", box: "[0.0, 1.5, 0.3]" };

const decimal = (text: string): string => (/[.e]/.test(text) ? text : `${text}.0`);

/** The scenario of a design, as the program reads it. */
export function scenario(design: Design, frames = Number(design.frames)): string {
  const off = (design.off ?? "").split(",").filter(Boolean);
  const room = rooms[design.scene!];
  const lines = [
    "# Made by the page of sensel. `sensel run page.toml` gives the same hashes.",
    `seed = ${design.seed}`,
    "[scene]", `${room ? "generator" : "target"} = "${design.scene}"`,
    // Rooms are baked with few rays, so that the first picture appears sooner.
    ...(room ? ['bake = "sketch"'] : []), `illuminance_lux = ${decimal(design.lux!)}`,
    "[motion]", `kind = "${design.motion}"`, `offset_m = ${room ?? "[0.0, 0.0, 0.0]"}`,
    // Boards stand in front of a still camera; the other motions start facing away from them.
    ...(!room && design.motion !== "still" ? ["world_from_motion = [0.0, 1.0, 0.0, 0.0]"] : []),
    ...(design.motion === "spin" ? [`rate_deg_per_s = ${decimal(design.rate!)}`] : []),
    "[rig]", `baseline_mm = ${design.rig}`,
    "[run]", `frames = ${frames}`, `samples_per_pixel = ${design.rays}`,
    ...(off.length ? [`effects = "${off.map((name) => `-${name}`).join(",")}"`] : []),
    "[optics]", `preset = "${design.lens}"`, `f_number = ${decimal(design.fnumber!)}`,
    "[sensor]", `width = ${design.size}`, `height = ${(Number(design.size) * 3) / 4}`, `temperature_k = ${decimal(design.kelvin!)}`,
    "[sensor.pixel]", `type = "${design.shutter === "rolling" ? "4T" : "6T"}"`, `full_well_e = ${decimal(design.well!)}`,
    `read_noise_uv = ${decimal(design.read!)}`,
    "[sensor.adc]", `bits = ${design.bits}`, `gain = ${decimal(design.gain!)}`, `cds = "${design.cds}"`, `ramp = "${design.ramp}"`,
    ...(design.ramp === "piecewise" ? ["ramp_points = [[0.5, 0.2]]"] : []),
    "[sensor.readout]", `exposure_us = ${decimal(String(Number((Number(design.exposure) * 1000).toPrecision(6))))}`,
    `shutter = "${design.shutter}"`, `hts = ${design.hts}`,
    "[compute]", `threshold = ${Number(design.threshold) * 2 ** (Number(design.word) - 8)}`, "target_features = 0",
    `pipeline_bits = ${design.word}`, `descriptor_bits = ${design.descriptor}`,
    "[link]", `mode = "${design.link}"`,
  ];
  return `${lines.join("\n")}\n`;
}
