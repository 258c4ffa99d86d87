// The page: controls to scenario text, frames to the canvas. No physics and no numbers of its own.
const $ = (id) => document.getElementById(id);
const defaults = { lux: "3", exposure: "0.8", bits: "10", read: "100", threshold: "20", shutter: "global" };
const state = { ...defaults, ...Object.fromEntries(new URLSearchParams(location.hash.slice(1))) };
const worker = new Worker("worker.js", { type: "module" });
let serial = 0, busy = false, dirty = true, playing = false;

const lux = () => 10 ** Number(state.lux);
const exposureUs = () => Math.round(10 ** Number(state.exposure) * 1000);
const significant = (value) => Number(value.toPrecision(3)).toLocaleString("en");

function scenario(shown = 300) {
  return `# Made by the browser page of sensel.
[scene]
generator = "box"
illuminance_lux = ${lux().toPrecision(4)}
[motion]
kind = "sway"
offset_m = [0.0, 1.5, 0.3]
[rig]
baseline_mm = 0.0
[run]
frames = ${shown}
[sensor]
width = 320
height = 240
[sensor.pixel]
read_noise_uv = ${Number(state.read).toFixed(1)}
[sensor.adc]
bits = ${state.bits}
[sensor.readout]
exposure_us = ${exposureUs().toFixed(1)}
shutter = "${state.shutter}"
[compute]
threshold = ${state.threshold}
`;
}

function showControls() {
  for (const id of ["lux", "exposure", "bits", "read", "threshold"]) $(id).value = state[id];
  for (const radio of document.querySelectorAll("[name=shutter]")) radio.checked = radio.value === state.shutter;
  $("lux-out").value = `${significant(lux())} lux`;
  $("exposure-out").value = `${significant(exposureUs() / 1000)} ms`;
  $("bits-out").value = `${state.bits} bit`;
  $("read-out").value = `${state.read} µV`;
  $("threshold-out").value = `${state.threshold} DN`;
}

function request() {
  if (busy) return;
  busy = true;
  const message = { id: ++serial };
  if (dirty) message.scenario = scenario();
  dirty = false;
  worker.postMessage(message);
}

function changed() {
  history.replaceState(null, "", "#" + new URLSearchParams(state));
  showControls();
  dirty = true;
  request();
}

function draw({ width, height, pixels, features }) {
  const canvas = $("picture");
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d");
  context.putImageData(new ImageData(new Uint8ClampedArray(pixels.buffer), width, height), 0, 0);
  context.strokeStyle = "#ffb000";
  context.lineWidth = 0.75;
  for (let i = 0; i < features.length; i += 2) {
    context.strokeRect(features[i] - 1.5, features[i + 1] - 1.5, 4, 4);
  }
}

function showNumbers(summary, milliseconds) {
  const rows = [
    ["Frame", summary.frame], ["Features", summary.features], ["Mean code", `${summary.mean_code_dn.toFixed(1)} DN`],
    ["Raw picture", `${significant(summary.raw_bits)} bit`], ["Feature packets", `${significant(summary.feature_bits)} bit`],
    ["Energy of the sensor", `${significant(summary.energy_uj)} µJ`], ["Effects simulated", summary.kept.join(", ")],
    ["Effects left out", summary.omitted.join(", ") || "none"], ["Time in this browser", `${milliseconds.toFixed(0)} ms`],
    ["Photons", summary.hashes.photons.slice(0, 16)], ["Codes", summary.hashes.codes.slice(0, 16)],
    ["Features' bytes", summary.hashes.features.slice(0, 16)],
  ];
  $("numbers").replaceChildren(...rows.map(([name, value]) => {
    const [group, dt, dd] = ["div", "dt", "dd"].map((tag) => document.createElement(tag));
    dt.textContent = name;
    dd.textContent = value;
    group.append(dt, dd);
    return group;
  }));
  $("caption").textContent = `Frame ${summary.frame}: ${summary.features} corners found on the sensor.`;
}

worker.onmessage = ({ data }) => {
  busy = false;
  if (data.error) {
    $("caption").textContent = data.error;
    playing = false;
  } else {
    draw(data);
    showNumbers(data.summary, data.milliseconds);
    document.body.dataset.frame = data.summary.frame;
  }
  if (dirty || playing) request();
};

for (const id of ["lux", "exposure", "bits", "read", "threshold"]) {
  $(id).addEventListener("input", (event) => { state[id] = event.target.value; changed(); });
}
for (const radio of document.querySelectorAll("[name=shutter]")) {
  radio.addEventListener("change", () => { state.shutter = radio.value; changed(); });
}
$("step").addEventListener("click", request);
$("play").addEventListener("click", () => {
  playing = !playing;
  $("play").textContent = playing ? "Pause" : "Play";
  $("play").setAttribute("aria-pressed", playing);
  request();
});
$("save").addEventListener("click", () => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([scenario(1 + Number(document.body.dataset.frame ?? 0))], { type: "application/toml" }));
  link.download = "page.toml";
  link.click();
});
showControls();
request();
