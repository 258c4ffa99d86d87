// Native and WASM builds give the same bytes: hashes of photons, codes, features, energy and poses over fifty random scenarios, and over a
// run long enough for the tracker to follow and to adjust; that one natively on two threads as well. The WASM is the page's, with SIMD,
// and, with SENSEL_ALL_CASES set, the one of `web/build --plain`, without.
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { program, root } from "./browser.mjs";

const seed = Number(process.env.SENSEL_SEED ?? 20261121);
const cases = 50;
// The core tells its progress to whoever asks; nobody does here.
globalThis.senselProgress = () => {};
const folders = process.env.SENSEL_ALL_CASES ? ["web/dist", "target/plain"] : ["web/dist"];
const cores = await Promise.all(folders.map(async (folder) => {
  const bytes = readFileSync(join(root, folder, "sensel_web_bg.wasm"));
  const { initSync, Session } = await import(join(root, folder, "sensel_web.js"));
  initSync({ module: bytes });
  return { folder, Session, vectors: hasVectors(bytes) };
}));
if (!cores[0].vectors || cores[1]?.vectors) throw new Error("of web/dist and target/plain, the first has SIMD and the second none");

// Mulberry32: small, and only chooses cases.
let state = seed >>> 0;
const random = () => {
  state = (state + 0x6d2b79f5) >>> 0;
  let t = state;
  t = Math.imul(t ^ (t >>> 15), t | 1);
  t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
  return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
};
const pick = (...choices) => choices[Math.floor(random() * choices.length)];
const between = (low, high) => low + (high - low) * random();

function scenario() {
  const bits = 1 + Math.floor(random() * 16);
  // Rays to a target, or as many in every pixel.
  const stops = random() < 0.5;
  return {
    text: `seed = ${Math.floor(random() * 2 ** 31)}
[scene]
generator = "${pick("box", "columns")}"
bake = "${pick("full", "draft", "sketch")}"
illuminance_lux = ${(10 ** between(-1, 4)).toPrecision(6)}
illuminant = "${pick("D65", "A", "E", "FL11", "LED-B3")}"
[motion]
kind = "${pick("sway", "still")}"
offset_m = [0.0, 1.5, 0.3]
[run]
frames = 3
${stops ? `render_tolerance = ${pick("4.0", "0.5", "0.1")}` : `samples_per_pixel = ${pick(1, 3, 4, 8, 40)}`}
effects = "${pick("auto", "all", "all")}"
[rig]
baseline_mm = ${pick("0.0", "65.0")}
[optics]
preset = "${pick("pinhole_90", "radtan_90")}"
f_number = ${between(1.2, 8).toFixed(2)}
pupil = "${pick("thin_lens", "aplanatic")}"
[sensor]
width = ${16 + 8 * Math.floor(random() * 30)}
height = ${16 + Math.floor(random() * 200)}
temperature_k = ${between(260, 350).toFixed(1)}
[sensor.pixel]
type = "${pick("3T", "4T", "5T", "6T")}"
conversion_gain_uv_per_e = ${between(5, 150).toFixed(2)}
dark_current_e_per_s = ${(10 ** between(0, 5)).toFixed(1)}
[sensor.adc]
bits = ${bits}
cds = "${pick("none", "analog", "digital")}"
[sensor.readout]
shutter = "${pick("global", "rolling")}"
hts = 20000
exposure_us = ${between(1000, 15000).toFixed(1)}
[compute]
threshold = ${5 + Math.floor(random() * 40)}
[link]
frequency_hz = 800000000
`,
  };
}

// A lit room that two cameras move through: the tracker starts, follows and adjusts.
const tracked = {
  frames: 14,
  text: `seed = 7
[scene]
generator = "box"
illuminance_lux = 1000.0
illuminant = "D65"
[motion]
kind = "sway"
offset_m = [0.0, 1.5, 0.3]
[run]
frames = 14
render_tolerance = 4.0
[optics]
preset = "radtan_90"
[sensor]
width = 320
height = 240
[sensor.readout]
exposure_us = 6000.0
[compute]
threshold = 10
`,
};

const stages = ["photons", "codes", "features", "energy", "poses"];
const folder = mkdtempSync(join(tmpdir(), "sensel-bits-"));
let passed = 0, failed = 0, features = 0, poses = 0, keyframes = 0;

// The native program's hashes of a file, or what it complained of.
function natively(file, threads) {
  const out = join(folder, "out");
  const run = spawnSync(program(), ["run", file, "--quiet", "--threads", threads, "--out", out], { encoding: "utf8" });
  if (run.status !== 0) return { complaint: run.stderr };
  const { hashes } = JSON.parse(readFileSync(join(out, "report.json"), "utf8"));
  rmSync(out, { recursive: true });
  return hashes;
}

/** Whether a module has vector instructions: f32x4.add is three bytes, which come by chance once in 16 million positions. */
function hasVectors(bytes) {
  let count = 0;
  for (let at = bytes.indexOf("fde401", 0, "hex"); at >= 0; at = bytes.indexOf("fde401", at + 3, "hex")) count += 1;
  return count > 100;
}

function inTheBrowser({ Session }, { text, frames }) {
  const session = new Session(text);
  let summary;
  for (let frame = 0; frame < frames; frame += 1) {
    session.step();
    summary = JSON.parse(session.summary());
    features += summary.features;
    poses += summary.has_pose;
    keyframes += summary.keyframe;
  }
  session.free();
  return summary.hashes;
}

const same = (one, other) => stages.every((stage) => one[stage]?.length === 64 && one[stage] === other[stage]);

try {
  for (let number = 0; number <= cases; number += 1) {
    const tried = number < cases ? { ...scenario(), frames: 3 } : tracked;
    const file = join(folder, `case${number}.toml`);
    writeFileSync(file, tried.text);
    const native = natively(file, "1");
    const wasm = cores.map((core) => (native.complaint ? {} : inTheBrowser(core, tried)));
    const two = number < cases ? native : natively(file, "2");
    if (wasm.every((one) => same(native, one)) && same(native, two)) passed += 1;
    else {
      failed += 1;
      console.log(`case ${number} of seed ${seed} differs: ${JSON.stringify({ wasm, native, two })}\n${tried.text}`);
    }
  }
} finally {
  rmSync(folder, { recursive: true });
}
// Cases without features or poses would compare empty lists.
for (const [what, count, least] of [["features", features, 1_000], ["poses", poses, 12], ["keyframes", keyframes, 2]]) {
  console.log(`seed ${seed}: ${count} ${what} compared`);
  if (count < least) {
    failed += 1;
    console.log(`fewer than ${least} ${what}`);
  }
}
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed === 0 ? 0 : 1);
