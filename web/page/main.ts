//! The page: controls to a scenario, frames to the canvas, figures to the panels. No physics and no numbers of its own.
import { Compare } from "./compare.js";
import { Controls } from "./controls.js";
import { Conversion, type Probed } from "./conversion.js";
import { type AccuracyRow, Cost } from "./cost.js";
import { accepted, control, controlOf, defaults, type Design, fromAddress, named, scenario, toAddress } from "./design.js";
import { chromeTrace, png16, save } from "./downloads.js";
import { type Corner, Features } from "./features.js";
import { bits, byId, make, short } from "./ink.js";
import { Noise, type NoiseAnswer, type TransferAnswer } from "./noise.js";
import { Picture } from "./picture.js";
import { Rows } from "./rows.js";
import { Cancelled, type FrameAnswer, Simulator, type Summary } from "./simulator.js";
import { stories } from "./stories.js";

const tabs = ["pixel", "rows", "features", "noise", "pose", "energy", "ladder", "compare"];
const address = fromAddress(location.hash.slice(1));
let design: Design = address.design;
let other: Design | undefined = address.more.has("b") ? fromAddress(address.more.get("b")!).design : undefined;
let tab = tabs.includes(address.more.get("tab") ?? "") ? address.more.get("tab")! : "pixel";
let story = stories.find((one) => one.id === address.more.get("story"));
let storyStep = 0;
let shownFrames = 0;
let playing = false, dirty = true, working = false, wanted = false;

const simulator = new Simulator(progress), second = new Simulator(progress);
const conversion = new Conversion(), rows = new Rows(drag), features = new Features(), cost = new Cost(), compare = new Compare();
const picture = new Picture(() => { remember(); schedule(); });
const controls = new Controls(change);
const noise = new Noise((number) => simulator.ask("noisePicture", number), switchEffect,
  () => ({ width: picture.last!.width, height: picture.last!.height }));
let refreshing = 0;

function progress(what: string, share: number): void {
  byId("progress").hidden = false;
  byId<HTMLProgressElement>("progress-bar").value = share;
  byId("progress-text").textContent = what;
}

/** What the address says beside the design. */
function remember(): void {
  const { x, y } = picture.probe, more: Record<string, string> = { tab, x: String(x), y: String(y) };
  if (other) more.b = toAddress(other, {});
  if (story) more.story = story.id;
  history.replaceState(null, "", `#${toAddress(design, more)}`);
}

function change(id: string, value: string): void {
  controls.clear(id);
  byId("address-note").textContent = "";
  if (tab === "compare") other = { ...(other ?? design), [id]: value };
  else design = { ...design, [id]: value };
  restart();
}

/** A value dragged in a drawing, within its control's range. */
function drag(id: string, value: number): void {
  const one = control(id);
  change(id, accepted(one, String(Math.min(one.max!, Math.max(one.min!, Number(value.toPrecision(3)))))) ?? design[id]!);
}

function switchEffect(name: string, on: boolean): void {
  const off = new Set((design.off ?? "").split(",").filter(Boolean));
  if (on) off.delete(name);
  else off.add(name);
  design = { ...design, off: [...off].join(",") };
  restart();
}

/** The design that the controls are those of. */
function shownDesign(): Design {
  return tab === "compare" ? other ?? design : design;
}

function restart(): void {
  dirty = true;
  stopped = false;
  byId("problem").textContent = "";
  controls.show(shownDesign());
  remember();
  void work();
}

/** One frame after another while there is reason for one. */
async function work(): Promise<void> {
  if (working) return;
  working = true;
  const late = setTimeout(() => {
    byId("cancel").hidden = false;
    progress("simulating", 0);
  }, 200);
  try {
    const started = dirty;
    // A step that was asked for while a new design had not begun yet comes after its first frame.
    if (started) dirty = false;
    else wanted = false;
    const frame = (core: Simulator, one: Design): Promise<FrameAnswer> =>
      (started ? core.ask<FrameAnswer>("start", scenario(one)) : core.ask<FrameAnswer>("step"));
    // Each design has its own worker: both frames are made at the same time.
    const both = other && tab === "compare" ? [frame(simulator, design), frame(second, other)] : [frame(simulator, design)];
    const [answer, beside] = await Promise.all(both) as [FrameAnswer, FrameAnswer | undefined];
    if (beside) {
      picture.wiper = Number(byId<HTMLInputElement>("wiper").value) / 100;
      picture.showOther(beside);
      compare.add(answer.summary, beside.summary);
    }
    clearTimeout(late);
    byId("progress").hidden = true;
    controls.clear();
    byId("problem").textContent = "";
    picture.show(answer);
    shownFrames += 1;
    describe(answer);
    cost.note(answer.summary);
    await refresh();
  } catch (error) {
    [playing, wanted] = [false, false];
    if (!(error instanceof Cancelled)) await complain((error as Error).message);
    else dirty = true;
  } finally {
    clearTimeout(late);
    byId("progress").hidden = true;
    byId("cancel").hidden = true;
    working = false;
  }
  showPlaying();
  if (dirty && !byId("problem").textContent && !stopped) void work();
  else if (playing || (wanted && !stopped)) setTimeout(() => void work(), 0);
}

let stopped = false;

async function complain(message: string): Promise<void> {
  await built;
  const id = controlOf(message);
  const said = message.replace(/^scenario:\d+: /, "");
  controls.complain(id, said);
  byId("problem").textContent = id ? `${control(id).label}: ${said}` : said;
}

/** One sentence of what is seen. */
function describe({ summary, milliseconds }: FrameAnswer): void {
  const light = short(Number(design.lux)), photons = short(summary.mean_photons);
  const clipped = summary.saturated > 0.01 ? ` ${short(100 * summary.saturated, 2)} % of the pixels are full.` : "";
  const shutter = summary.rolling ? "row after row" : "all rows at once";
  const which = tab === "compare" ? `Design A, frame ${summary.frame}` : `Frame ${summary.frame}`;
  byId("caption").textContent = `${which}: at ${light} lux each pixel gathers about ${photons} photons in ` +
    `${short(summary.exposure_us / 1000)} ms, ${shutter}; the extractor finds ${summary.features} corners.${clipped}`;
  if (document.body.dataset.first === undefined) {
    performance.mark("first picture");
    document.body.dataset.first = performance.now().toFixed(0);
  }
  document.body.dataset.frame = String(summary.frame);
  document.body.dataset.ms = milliseconds.toFixed(1);
  byId("machine").textContent = `${short(milliseconds)} ms to simulate`;
  byId("hashes").replaceChildren(...Object.entries(summary.hashes).map(([name, value]) =>
    make("div", {}, make("dt", {}, name), make("dd", { title: value }, value.slice(0, 16)))));
  byId("summary-line").textContent = `${bits(summary.raw_bits)} raw, ${bits(summary.feature_bits)} as features, ` +
    `${short(summary.energy.power_mw)} mW, ${short(summary.fps)} frames a second.`;
}

function schedule(): void {
  cancelAnimationFrame(refreshing);
  refreshing = requestAnimationFrame(() => { if (!working) void refresh().catch(quiet); });
}

function quiet(error: Error): void {
  if (!(error instanceof Cancelled)) byId("problem").textContent = error.message;
}

/** The shown panel, from the last frame. */
async function refresh(): Promise<void> {
  const answer = picture.last;
  if (!answer) return;
  const { x, y } = picture.probe, { summary } = answer, inside = x < answer.width && y < answer.height;
  if (!inside) picture.probe = { x: answer.width >> 1, y: answer.height >> 1 };
  const place = picture.probe;
  const probed = await simulator.ask<Probed>("probe", place.x, place.y);
  conversion.showProbe(probed);
  document.body.dataset.probe = `${probed.x},${probed.y}`;
  if (tab === "pixel") {
    await simulator.ask<Float64Array>("conversion", place.x, place.y).then(
      (table) => conversion.showTrace(table), (error: Error) => conversion.showError(error.message));
  } else if (tab === "rows") {
    rows.show(await simulator.ask<Float64Array>("rows"), summary, picture.source, place.y);
  } else if (tab === "features") {
    features.showPackets(await simulator.ask<Float64Array>("packets"), summary);
    if (picture.corner < 0) picture.corner = picture.strongest;
    const corner = picture.corner < 0 ? undefined : await simulator.ask<Corner>("corner", picture.corner);
    picture.drawOver();
    features.showCorner(corner);
  } else if (tab === "noise") {
    await noise.show(await simulator.ask<NoiseAnswer>("noise"), summary, (design.off ?? "").split(",").filter(Boolean));
  } else if (tab === "pose") {
    const [path, truth] = await Promise.all([simulator.ask<Float64Array>("trajectory"), simulator.ask<Float64Array>("truth")]);
    await cost.showPose(path, truth, summary);
  } else if (tab === "energy") {
    cost.showEnergy(summary);
  } else if (tab === "ladder") {
    cost.showStages(summary);
  } else {
    const changed = other ? Object.keys(other).filter((key) => other![key] !== design[key]) : [];
    compare.show(changed.map((key) => (["off", "seed", "frames"].includes(key) ? key
      : `${control(key).label} (${named(key, design[key]!)} in A, ${named(key, other![key]!)} in B)`)));
  }
  document.body.dataset.shown = `${tab} ${summary.frame} ${place.x},${place.y}`;
}

function choose(name: string, focus = false): void {
  tab = name;
  for (const one of tabs) {
    const button = byId(`tab-${one}`), chosen = one === name;
    button.setAttribute("aria-selected", String(chosen));
    button.tabIndex = chosen ? 0 : -1;
    byId(`panel-${one}`).hidden = !chosen;
    if (chosen && focus) button.focus();
  }
  byId("wiper-row").hidden = name !== "compare";
  if (name === "compare") {
    // Both designs start together, so that their frames have the same draws.
    other ??= { ...design };
    dirty = true;
    if (picture.last) void work();
  } else if (picture.wiper < 1) {
    picture.wiper = 1;
    picture.draw();
  }
  controls.show(shownDesign());
  byId("controls-title").textContent = name === "compare" ? "Design B" : "Design";
  remember();
  schedule();
}

function showPlaying(): void {
  byId("play").textContent = playing ? "Pause" : "Play";
  byId("play").setAttribute("aria-pressed", String(playing));
}

function tell(): void {
  const host = byId("story");
  host.hidden = !story;
  for (const button of document.querySelectorAll<HTMLElement>("[data-story]")) {
    button.setAttribute("aria-pressed", String(button.dataset.story === story?.id));
  }
  if (!story) return;
  const step = story.steps[storyStep]!, last = storyStep === story.steps.length - 1;
  byId("story-title").textContent = story.title;
  byId("story-count").textContent = `${storyStep + 1} of ${story.steps.length}`;
  byId("story-text").textContent = step.text;
  byId("story-next").textContent = last ? "To the free instrument" : "Next";
  byId<HTMLButtonElement>("story-back").disabled = storyStep === 0;
  if (step.design) {
    design = { ...defaults, ...step.design };
    other = step.other && { ...design, ...step.other };
    picture.wiper = 1;
    picture.showOther(undefined);
    noise.forget();
    dirty = true;
  }
  stopped = false;
  playing = step.play ?? false;
  byId("address-note").textContent = "";
  // On a phone the picture is below the fold otherwise.
  if (matchMedia("(max-width: 30rem)").matches) host.scrollIntoView();
  choose(step.tab);
  restart();
}

function connect(): void {
  byId("play").addEventListener("click", () => {
    playing = !playing;
    stopped = false;
    showPlaying();
    if (playing) void work();
  });
  byId("step").addEventListener("click", () => {
    [playing, stopped, wanted] = [false, false, working || !dirty];
    showPlaying();
    void work();
  });
  byId("restart").addEventListener("click", () => { stopped = false; restart(); });
  byId("cancel").addEventListener("click", () => {
    playing = false;
    stopped = true;
    simulator.cancel();
    second.cancel();
    dirty = true;
    byId("caption").textContent = "Stopped. Press Step or Play to start again.";
  });
  byId("features-shown").addEventListener("change", (event) => {
    picture.showsFeatures = (event.target as HTMLInputElement).checked;
    picture.drawOver();
  });
  byId("reset").addEventListener("click", () => {
    if (tab === "compare") other = { ...design };
    else design = { ...defaults };
    controls.clear();
    restart();
  });
  byId("copy").addEventListener("click", () => {
    remember();
    const done = (words: string): void => {
      byId("copy").textContent = words;
      setTimeout(() => { byId("copy").textContent = "Copy link"; }, 2000);
    };
    navigator.clipboard.writeText(location.href).then(() => done("Copied"), () => done("The address bar has it"));
  });
  byId("wiper").addEventListener("input", (event) => {
    picture.wiper = Number((event.target as HTMLInputElement).value) / 100;
    picture.draw();
  });
  byId("measure").addEventListener("click", () => void measure());
  byId("judge").addEventListener("click", () => void judge());
  tabs.forEach((name, place) => {
    const button = byId(`tab-${name}`);
    button.addEventListener("click", () => choose(name));
    button.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (way !== undefined) choose(tabs[(place + way + tabs.length) % tabs.length]!, true);
    });
  });
  byId("stories").append(...stories.map((one) => {
    const button = make("button", { type: "button", "data-story": one.id, "aria-pressed": "false" }, one.title);
    button.addEventListener("click", () => { [story, storyStep] = [one, 0]; tell(); });
    return button;
  }));
  byId("story-next").addEventListener("click", () => {
    storyStep += 1;
    if (storyStep >= story!.steps.length) [story, storyStep] = [undefined, 0];
    tell();
    remember();
  });
  byId("story-back").addEventListener("click", () => { storyStep -= 1; tell(); });
  byId("story-end").addEventListener("click", () => { story = undefined; tell(); remember(); });
  for (const button of document.querySelectorAll<HTMLElement>("[data-save]")) {
    button.addEventListener("click", () => void download(button.dataset.save!).catch(quiet));
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { picture.draw(); schedule(); });
}

async function measure(): Promise<void> {
  byId("cancel").hidden = false;
  try {
    await noise.showTransfer(await simulator.ask<TransferAnswer>("transfer"));
  } catch (error) {
    quiet(error as Error);
  } finally {
    byId("progress").hidden = true;
    byId("cancel").hidden = true;
  }
}

/** The first frame by each knob and rung: what it takes here, and how far it is from the best. */
async function judge(): Promise<void> {
  byId("cancel").hidden = false;
  try {
    const by = (rays: string, ...keys: string[]): string =>
      scenario({ ...design, rays }, 2).replace("[run]", ["[run]", ...keys].join("\n"));
    // Effects that a person switched off stay off.
    const all = design.off ? [] : ['effects = "all"'], tolerance = (ratio: string): string =>
      by("1", ...all).replace("samples_per_pixel = 1", `render_tolerance = ${ratio}`);
    const settings: [string, string][] = [
      ["1 ray per pixel", by("1", ...all)], ["4 rays per pixel", by("4", ...all)], ["16 rays per pixel", by("16", ...all)],
      ["rays to a variance of 4", tolerance("4.0")], ["rays to a variance of 1", tolerance("1.0")],
      ["64 rays, effects by plan", by("64")], ["64 rays, all effects, clock by clock", by("64", 'rung = "clocked"', ...all)],
      ["64 rays, all effects, closed form", by("64", ...all)],
    ];
    cost.showAccuracy(await simulator.ask<AccuracyRow[]>("accuracy", settings));
  } catch (error) {
    quiet(error as Error);
  } finally {
    byId("progress").hidden = true;
    byId("cancel").hidden = true;
  }
}

/** The run of the frames shown so far once more, by a scenario of just so many frames: a fitted motion knows its run's length. */
async function replay(frames: number): Promise<{ text: string; hashes: Record<string, string> }> {
  byId("cancel").hidden = false;
  try {
    const text = scenario(design, frames);
    let { summary } = await second.ask<FrameAnswer>("start", text);
    for (let frame = 1; frame < frames; frame += 1) {
      progress("the same frames once more", frame / frames);
      ({ summary } = await second.ask<FrameAnswer>("step"));
    }
    return { text, hashes: summary.hashes };
  } finally {
    byId("progress").hidden = true;
    byId("cancel").hidden = true;
  }
}

async function download(what: string): Promise<void> {
  const { last, probe } = picture;
  if (!last) return;
  const shown = last.summary.frame + 1;
  if (what === "png") save(`codes_${last.summary.frame}.png`, "image/png", ...await png16(last.codes, last.width, last.height));
  else if (what === "toml") {
    const { text, hashes } = await replay(shown);
    const lines = Object.entries(hashes).map(([name, value]) => `# ${name} ${value}\n`);
    save("page.toml", "application/toml", text, "# Hashes of report.json:\n", ...lines);
  } else if (what === "report") {
    await replay(shown);
    save("report.json", "application/json", await second.ask<string>("report"));
  } else if (what === "trace") {
    const [spans, packets]: [Float64Array, Float64Array] = [await simulator.ask("rows"), await simulator.ask("packets")];
    save("trace.json", "application/json", chromeTrace(spans, packets, last.summary as Summary));
  } else {
    save(`pixel_${probe.x}_${probe.y}.${what}`, "application/octet-stream",
      await simulator.ask<Uint8Array<ArrayBuffer>>("waveform", probe.x, probe.y, what));
  }
}

const place = (name: string, count: number): number => {
  const value = Number(address.more.get(name) ?? count >> 1);
  return Number.isInteger(value) && value >= 0 && value < count ? value : count >> 1;
};
const across = Number(design.size);
picture.probe = { x: place("x", across), y: place("y", (across * 3) / 4) };
connect();
byId("address-note").textContent = address.refused.join(" ");
choose(tab);
if (story) tell();
else restart();
// The core is at work already; the controls are made meanwhile.
const built = controls.build(shownDesign);
// For the page's own tests.
Object.assign(globalThis, { sensel: {
  probes: (places: [number, number][]) => simulator.ask("probes", places),
  scenario: () => scenario(design),
  memory: () => simulator.ask("memory"),
  stages: () => picture.last?.summary.stages_ms,
  frames: () => shownFrames,
} });
