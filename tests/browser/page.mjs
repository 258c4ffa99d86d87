// The page in Chromium: it loads fast, plays, follows every control by keyboard, shows the program's own electrons and codes, keeps its
// state in the address, writes files that others read, stops at once, says what is wrong, and is accessible in light and dark.
import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { inflateSync } from "node:zlib";
import { axe, launch, open, program, root, shown } from "./browser.mjs";
import { Checks } from "./check.mjs";
import { serve } from "./server.mjs";

const shots = join(root, "target/check/page");
mkdirSync(shots, { recursive: true });
const folder = mkdtempSync(join(tmpdir(), "sensel-page-"));
const checks = new Checks();
const server = await serve(join(root, "web/dist"));
const browser = await launch();
// Processor time that the first picture may take, in jobs of `reference_ms`: a second on a machine whose job takes 274 ms.
const FIRST_PICTURE_JOBS = 1000 / 274;
const tabs = ["pixel", "rows", "features", "noise", "pose", "energy", "ladder", "compare"];

/** Codes of a grey PNG of 16 bits, as the page writes them or as the program does. */
function png(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const [width, height, depth] = [view.getUint32(16), view.getUint32(20), bytes[24]], parts = [];
  for (let at = 8; at < bytes.length;) {
    const length = view.getUint32(at), kind = bytes.toString("latin1", at + 4, at + 8);
    if (kind === "IDAT") parts.push(bytes.subarray(at + 8, at + 8 + length));
    at += 12 + length;
  }
  const raw = inflateSync(Buffer.concat(parts)), step = depth / 8, stride = 1 + width * step, codes = new Uint16Array(width * height);
  const before = Buffer.alloc(stride - 1);
  for (let y = 0; y < height; y += 1) {
    const filter = raw[y * stride], row = raw.subarray(y * stride + 1, (y + 1) * stride);
    for (let at = 0; at < row.length; at += 1) {
      const [left, up, corner] = [at >= step ? row[at - step] : 0, before[at], at >= step ? before[at - step] : 0];
      const [a, b, c] = [Math.abs(up - corner), Math.abs(left - corner), Math.abs(left + up - 2 * corner)];
      row[at] += [0, left, up, (left + up) >> 1, a <= b && a <= c ? left : b <= c ? up : corner][filter];
    }
    row.copy(before);
    for (let x = 0; x < width; x += 1) codes[y * width + x] = step === 2 ? row.readUInt16BE(2 * x) : row[x];
  }
  return { width, height, depth, codes };
}

/** The first channel of an OpenEXR file, read by the judges' Python. */
function floats(file) {
  const script = "import sys, numpy, mitsuba; mitsuba.set_variant('scalar_rgb'); picture = numpy.array(mitsuba.Bitmap(sys.argv[1])); " +
    "sys.stdout.buffer.write(picture.reshape(picture.shape[0] * picture.shape[1], -1)[:, 0].astype('<f4').tobytes())";
  const python = process.env.SENSEL_JUDGE_PYTHON ?? join(root, "target/judges/bin/python");
  const read = spawnSync(python, ["-c", script, file], { maxBuffer: 1e9 });
  if (read.status !== 0) throw new Error(read.stderr.toString());
  return new Float32Array(new Uint8Array(read.stdout).buffer);
}

async function download(page, what) {
  await page.locator(".menu summary").click();
  const [file] = await Promise.all([page.waitForEvent("download"), page.locator(`[data-save=${what}]`).click()]);
  await page.locator(".menu summary").click();
  const path = join(folder, file.suggestedFilename());
  await file.saveAs(path);
  return path;
}

await checks.part("the page loads and plays", async () => {
  const { page, context, complaints, asked } = await open(browser, server.address);
  await shown(page, /^pixel 0 /);
  await page.waitForLoadState("networkidle");
  const bytes = [...server.bytes.values()].reduce((sum, size) => sum + size, 0);
  console.log(`${(bytes / 1e6).toFixed(3)} MB in ${server.bytes.size} files`);
  checks.that("all transfers are under 1.5 MB", bytes < 1_500_000, bytes);
  await page.locator("#play").click();
  await page.waitForFunction(() => Number(document.body.dataset.frame) >= 5, undefined, { timeout: 120_000 });
  await page.locator("#play").click();
  const paused = Number(await page.evaluate(() => document.body.dataset.frame));
  await page.waitForTimeout(500);
  const still = Number(await page.evaluate(() => document.body.dataset.frame));
  checks.that("pause stops within a frame", still - paused <= 1, paused, still);
  await page.locator("#step").click();
  await page.waitForFunction((frame) => Number(document.body.dataset.frame) === frame + 1, still, { timeout: 60_000 });
  checks.that("no request leaves the page's own origin", asked.every((url) => url.startsWith(server.address) || url.startsWith("data:")
    || url.startsWith("blob:")), asked);
  checks.that("the console has no complaint", complaints.length === 0, complaints);
  // Progress is shown, and cancelling answers at once: a slow frame of many rays. Other work on the machine only adds time, so the best of
  // three counts.
  const times_ms = [];
  while (times_ms.length < 3 && !(Math.min(...times_ms) < 100)) {
    await page.goto(`${server.address}#rays=64&size=640`);
    await page.reload();
    await page.locator("#cancel").waitFor({ state: "visible", timeout: 60_000 });
    await page.waitForTimeout(600);
    times_ms.push(await page.evaluate(async () => {
      const started = performance.now();
      document.getElementById("cancel").click();
      while (!document.getElementById("cancel").hidden) await new Promise((done) => setTimeout(done, 1));
      return performance.now() - started;
    }));
  }
  console.log(`cancel: ${times_ms.map((time_ms) => time_ms.toFixed(0)).join(", ")} ms`);
  checks.that("cancel ends the run within 100 ms", Math.min(...times_ms) < 100, times_ms);
  await context.close();
}, { timed: true });

await checks.part("the first picture comes within a second", async () => {
  // From the beginning of the navigation until the frame is on the canvas: transfer, compilation, the room and its light, the sensor.
  // Other programs only add time, so the best of some rounds counts; a round is the median of seven loads. Wall time is held to its bound
  // each week, on a quiet machine; each day the processor time is, in the part after this one.
  const isWeekly = Boolean(process.env.SENSEL_ALL_CASES), rounds_ms = [];
  while (rounds_ms.length < (isWeekly ? 6 : 1) && !(Math.min(...rounds_ms) < 1000)) {
    const loads_ms = [];
    for (let load = 0; load < 7; load += 1) {
      const { page, context } = await open(browser, server.address);
      await shown(page, /^pixel 0 /);
      loads_ms.push(Number(await page.evaluate(() => document.body.dataset.first)));
      await context.close();
    }
    loads_ms.sort((a, b) => a - b);
    console.log(`first picture after ${loads_ms.join(", ")} ms`);
    rounds_ms.push(loads_ms[3]);
  }
  checks.that("every load shows its first picture", rounds_ms.every((round_ms) => round_ms > 0), rounds_ms);
  if (isWeekly) checks.that("the median of seven loads is under a second", Math.min(...rounds_ms) < 1000, rounds_ms);
}, { timed: true });

// The processor time of each task of the main thread, and of page and worker until the first picture, over a walk through all panels.
async function traced() {
  const context = await browser.newContext({ viewport: { width: 1440, height: 1000 } }), page = await context.newPage();
  await page.goto(`${server.address}uPlot-LICENSE.txt`);
  const path = join(folder, "trace.json");
  await browser.startTracing(page, { path, categories: ["toplevel", "devtools.timeline", "blink.user_timing"] });
  await page.goto(server.address);
  await shown(page, /^pixel 0 /);
  await page.locator("#play").click();
  for (const tab of tabs) {
    const frames = await page.evaluate(() => globalThis.sensel.frames());
    await page.locator(`#tab-${tab}`).click();
    await shown(page, new RegExp(`^${tab} `));
    await page.waitForFunction((before) => globalThis.sensel.frames() > before + 1, frames, { timeout: 60_000 });
  }
  await page.locator("#tab-pixel").click();
  await page.locator("#lux").focus();
  for (let press = 0; press < 10; press += 1) await page.keyboard.press("ArrowLeft");
  await page.locator("#frame").hover({ position: { x: 200, y: 150 } });
  await page.waitForTimeout(500);
  await browser.stopTracing();
  await context.close();
  const events = JSON.parse(readFileSync(path)).traceEvents;
  const threads = (name) => new Set(events.filter((event) => event.name === "thread_name" && name.test(event.args.name))
    .map((event) => `${event.pid}:${event.tid}`));
  const tasks = (own) => events.filter((event) => event.ph === "X" && /RunTask$/.test(event.name) && own.has(`${event.pid}:${event.tid}`));
  // Processor time of the threads: what other programs take of the machine does not count.
  const tasks_ms = tasks(threads(/^CrRendererMain$/)).map((event) => (event.tdur ?? 0) / 1000);
  const shown_us = events.find((event) => event.name === "first picture").ts;
  const until_ms = tasks(threads(/^(CrRendererMain|DedicatedWorker)/)).filter((event) => event.ts < shown_us)
    .reduce((sum, event) => sum + (event.tdur ?? 0) / 1000, 0);
  console.log(`first picture: ${until_ms.toFixed(0)} ms of processor time of page and worker`);
  console.log(`main thread: ${tasks_ms.length} tasks, the longest ${Math.max(...tasks_ms).toFixed(0)} ms of processor time`);
  return { tasks_ms, until_ms };
}

// The time of a fixed job in the same engine, the best of nine: machines differ, so the first picture is compared with it.
async function reference_ms() {
  const { page, context } = await open(browser, `${server.address}uPlot-LICENSE.txt`);
  const times_ms = [];
  for (let round = 0; round < 9; round += 1) {
    times_ms.push(await page.evaluate(() => {
      const started = performance.now();
      let state = 1;
      for (let step = 0; step < 50_000_000; step += 1) state = Math.imul(state ^ (state >>> 15), 0x2c1b3c6d) + step | 0;
      globalThis.state = state;
      return performance.now() - started;
    }));
  }
  await context.close();
  return Math.min(...times_ms);
}

await checks.part("nothing blocks the main thread", async () => {
  // What a virtual machine takes away counts as processor time, so the best of three walks counts, each beside its own reference.
  const longest_ms = ({ tasks_ms }) => Math.max(...tasks_ms);
  const used = (walk) => Math.max(walk.jobs / FIRST_PICTURE_JOBS, longest_ms(walk) / 50); // Of the bounds; one walk is held to both.
  let best;
  for (let count = 0; count < 3 && !(best && used(best) < 1); count += 1) {
    const job_ms = await reference_ms(), walk = await traced();
    walk.jobs = walk.until_ms / job_ms;
    console.log(`first picture: ${walk.jobs.toFixed(1)} times the reference job of ${job_ms.toFixed(0)} ms`);
    if (!best || used(walk) < used(best)) best = walk;
  }
  checks.that("the first picture takes processor time within its bound", best.jobs > 0 && best.jobs < FIRST_PICTURE_JOBS, best.jobs);
  checks.that("the trace has the page's tasks", best.tasks_ms.length > 1000, best.tasks_ms.length);
  checks.that("no task takes 50 ms", longest_ms(best) < 50, longest_ms(best));
}, { timed: true });

await checks.part("a VGA sensor runs at fifteen frames a second", async () => {
  const { page, context } = await open(browser, `${server.address}#size=640`);
  await shown(page);
  const sensor_ms = () => page.evaluate(() => new Map(globalThis.sensel.stages()).get("sensor")), frames_ms = [];
  for (let frame = 0; frame < 8; frame += 1) {
    const before = await sensor_ms();
    await stepOnce(page);
    frames_ms.push(await sensor_ms() - before);
  }
  console.log(`sensor stage of VGA: ${frames_ms.map((frame_ms) => frame_ms.toFixed(0)).join(", ")} ms`);
  checks.that("its sensor stage takes less than a fifteenth of a second", Math.min(...frames_ms) < 1000 / 15, frames_ms);
  await context.close();
}, { timed: true });

await checks.part("playing on takes no more memory", async () => {
  // Every week ten minutes of the page as it is; else a minute of short runs, since a run begins again after its last frame.
  const long = Boolean(process.env.SENSEL_ALL_CASES), rounds = long ? 20 : 8, round_ms = long ? 30_000 : 6_000;
  const { page, context } = await open(browser, `${server.address}${long ? "" : "#size=160&frames=8"}`);
  const devtools = await context.newCDPSession(page), seen = [], started = performance.now();
  await shown(page);
  await page.locator("#play").click();
  for (let round = 0; round < rounds; round += 1) {
    // The panels draw and ask for different things.
    for (const tab of tabs.filter((one) => one !== "compare")) {
      await page.locator(`#tab-${tab}`).click();
      await page.waitForTimeout(round_ms / (tabs.length - 1));
    }
    await devtools.send("HeapProfiler.collectGarbage");
    const { usedSize } = await devtools.send("Runtime.getHeapUsage");
    seen.push({ frames: await page.evaluate(() => globalThis.sensel.frames()), core: await page.evaluate(() => globalThis.sensel.memory()),
      page: usedSize });
  }
  const megabytes = (bytes) => (bytes / 1e6).toFixed(2);
  for (const { frames, core, page: heap } of seen) console.log(`${frames} frames: core ${megabytes(core)}, page ${megabytes(heap)} MB`);
  const half = rounds / 2, most = (part, key) => Math.max(...part.map((one) => one[key]));
  const [early, late] = [seen.slice(0, half), seen.slice(half)], frames = seen.at(-1).frames - seen[half - 1].frames;
  console.log(`memory over ${((performance.now() - started) / 1000).toFixed(0)} s of playing`);
  checks.that("the page played on", frames > (long ? 2000 : 200), frames);
  checks.that("the core's memory does not grow", most(late, "core") === most(early, "core"), seen);
  // A frame that is kept has 115 kB or more of pixels and codes: the second half's would be 23 MB or more.
  checks.that("the page's memory does not grow", most(late, "page") < most(early, "page") + 1_000_000, seen);
  await context.close();
}, { timed: true });

await checks.part("every control works by keyboard, and the address keeps it", async () => {
  const { page, context } = await open(browser, `${server.address}#size=160&motion=spin`);
  await shown(page);
  const all = "#controls input[type=range], #controls select";
  const ids = await page.evaluate((selector) => [...document.querySelectorAll(selector)].map((one) => one.id), all);
  checks.that("there is a control for each idea", ids.length >= 19, ids);
  for (const id of ids) {
    const before = await page.evaluate(() => globalThis.sensel.scenario());
    await page.locator(`#${id}`).focus();
    const select = await page.evaluate((one) => document.getElementById(one).tagName === "SELECT", id);
    const keys = select ? ["ArrowDown", "ArrowUp"] : ["ArrowRight", "PageUp", "ArrowLeft", "PageDown", "PageDown"];
    let after = before;
    for (const key of keys) {
      if (after !== before) break;
      await page.keyboard.press(key);
      after = await page.evaluate(() => globalThis.sensel.scenario());
    }
    checks.that(`${id} changes the scenario by keyboard`, after !== before);
    if (id === "motion") await page.locator("#motion").selectOption("spin");
    if (id === "size") await page.locator("#size").selectOption("160");
  }
  await page.locator("#lux-value").fill("12,5");
  await page.locator("#lux-value").press("Enter");
  await page.locator("#lux-value").blur();
  const scenario = await page.evaluate(() => globalThis.sensel.scenario());
  checks.that("a typed value is taken", scenario.includes("illuminance_lux = 12.5"), scenario);
  const typings = [["lux", "10,000", "10000"], ["lux", "0,5", "0.5"], ["exposure", "8 ms", "8"], ["fnumber", "f/2.8", "2.8"]];
  for (const [id, text, value] of typings) {
    await page.locator(`#${id}-value`).fill(text);
    await page.locator(`#${id}-value`).press("Enter");
    const taken = await page.locator(`#${id}-value`).inputValue();
    checks.that(`"${text}" typed is ${value}`, taken === value, taken);
  }
  await page.locator("#lux-value").fill("much");
  await page.locator("#lux-value").blur();
  checks.that("a typed word is refused with the range", (await page.locator("#lux-error").textContent()).includes("0.001 to 100000"));
  const probe = () => page.evaluate(() => new URLSearchParams(location.hash.slice(1)).get("x"));
  await page.evaluate(() => scrollTo(0, 0));
  await page.locator("#frame").click({ position: { x: 100, y: 100 } });
  const clicked = await probe();
  await page.locator("#frame").hover({ position: { x: 300, y: 100 } });
  const under = await probe();
  await page.locator("h1").hover();
  checks.that("the mouse shows other pixels, and the clicked one returns when it leaves", clicked !== under && await probe() === clicked,
    clicked, under, await probe());
  await page.locator("#rays").scrollIntoViewIfNeeded();
  const seen = await page.locator("#frame").boundingBox();
  checks.that("the picture stays in sight beside the last control", seen.y >= 0 && seen.y + seen.height <= 1000, seen);
  await page.locator("#tab-rows").click();
  await page.locator("#frame").focus();
  await page.keyboard.press("Shift+ArrowRight");
  const address = await page.evaluate(() => location.href);
  const again = await open(browser, address);
  await shown(again.page, /^rows /);
  const state = () => [globalThis.sensel.scenario(), document.body.dataset.probe, document.querySelector("[aria-selected=true]").id].join();
  checks.that("the address gives the same design, pixel and panel", await page.evaluate(state) === await again.page.evaluate(state),
    await page.evaluate(state), await again.page.evaluate(state));
  await again.page.locator("#copy").click();
  checks.that("the button copies the address", await again.page.evaluate(() => navigator.clipboard.readText()) === address);
  await again.context.close();
  await context.close();
});

await checks.part("the core's errors stand beside their control", async () => {
  const { page, context } = await open(browser, `${server.address}#size=160&bits=14`);
  await page.waitForFunction(() => document.getElementById("problem").textContent !== "", undefined, { timeout: 60_000 });
  const words = await page.locator("#hts-error").textContent();
  checks.that("a line that is too short names the shortest", /sensor\.readout\.hts = 928: .*\d{3,}/.test(words), words);
  const shortest = words.match(/\b(\d{3,5})\b(?=[^\d]*$)/)?.[1];
  await page.locator("#hts-value").fill(shortest);
  await page.locator("#hts-value").press("Enter");
  await shown(page);
  checks.that("the line that it names does, and the message goes", (await page.locator("#hts-error").textContent()) === "", shortest);
  await context.close();
  const wrong = await open(browser, `${server.address}#size=160&lux=much`);
  await shown(wrong.page);
  const note = await wrong.page.locator("#address-note").textContent();
  checks.that("a value of the address that is refused is named with the range", /Light.*"much".*800 lux.*0\.001 to 100000/.test(note), note);
  await wrong.context.close();
});

await checks.part("probe and files say what the program says", async () => {
  const { page, context } = await open(browser, `${server.address}#motion=spin&rate=120&shutter=rolling&bits=9&lux=80&x=31&y=77`);
  await shown(page, /^pixel 0 31,77/);
  const toml = await download(page, "toml"), out = join(folder, "native");
  const run = spawnSync(program(), ["run", toml, "--quiet", "--keep", "electrons,codes", "--waves", join(folder, "native.vcd"),
    "--wave-rows", "77", "--wave-columns", "31", "--out", out], { encoding: "utf8" });
  checks.that("the program takes the page's scenario", run.status === 0, run.stderr);
  const native = JSON.parse(readFileSync(join(out, "report.json"), "utf8"));
  const ours = JSON.parse(readFileSync(await download(page, "report"), "utf8"));
  for (const stage of ["photons", "codes", "features", "energy", "poses"]) {
    const equal = ours.hashes[stage] === native.hashes[stage] && ours.hashes[stage].length === 64;
    checks.that(`the page's report has the program's hash of ${stage}`, equal);
  }
  const kept = join(out, "codes/cam0"), codes = png(readFileSync(join(kept, readdirSync(kept).find((name) => name.endsWith(".png")))));
  const mine = png(readFileSync(await download(page, "png")));
  const shift = codes.codes.reduce((most, code) => Math.max(most, code), 0) / mine.codes.reduce((most, code) => Math.max(most, code), 1);
  const alike = mine.codes.every((code, at) => code * shift === codes.codes[at]);
  checks.that("the PNG has 16 bits and the program's codes", mine.depth === 16 && alike, shift);
  const pixels = Array.from({ length: 200 }, (_, at) => [(at * 37) % 320, (at * 101) % 240]);
  const probes = await page.evaluate((asked) => globalThis.sensel.probes(asked), pixels);
  const equal = probes.filter((probe, at) => probe.code === mine.codes[pixels[at][1] * 320 + pixels[at][0]]).length;
  checks.that("the probe has the program's code for 200 pixels", equal === 200, equal);
  const electrons = join(out, "electrons/cam0"), values = floats(join(electrons, readdirSync(electrons)[0]));
  const same = probes.filter((probe, at) => Math.fround(probe.electrons) === values[pixels[at][1] * 320 + pixels[at][0]]).length;
  checks.that("the probe has the program's electrons for 200 pixels", same === 200, same, probes[0].electrons);
  const vcd = readFileSync(await download(page, "vcd"), "utf8"), theirs = readFileSync(join(folder, "native.vcd"), "utf8");
  const column = (text) => {
    const id = text.match(/scope module column_31[\s\S]*?\$var \w+ \d+ (\S+) counter/)[1];
    return text.split("\n").filter((line) => line.endsWith(` ${id}`)).join();
  };
  checks.that("the waveform's counter is the program's on every clock", column(vcd) === column(theirs) && column(vcd).length > 500);
  const fst = await download(page, "fst"), told = spawnSync("fst2vcd", ["-f", fst], { encoding: "utf8", maxBuffer: 1e9 });
  checks.that("fst2vcd reads the FST", told.status === 0 && told.stdout.includes("counter"), told.stderr);
  const trace = JSON.parse(readFileSync(await download(page, "trace"), "utf8"));
  const spans = trace.traceEvents.filter((event) => event.ph === "X");
  checks.that("the trace holds complete events only, with times", spans.length > 500 && spans.every((event) => event.ts !== undefined
    && event.dur > 0 && Number.isInteger(event.pid) && Number.isInteger(event.tid)), spans.length);
  await context.close();
});

await checks.part("stories and the comparison work", async () => {
  const { page, context } = await open(browser, `${server.address}#size=160`);
  await shown(page);
  const count = await page.locator("[data-story]").count();
  checks.that("there are seven stories", count === 7, count);
  for (let number = 0; number < count; number += 1) {
    await page.locator("[data-story]").nth(number).click();
    for (let step = 0; step < 6 && await page.locator("#story").isVisible(); step += 1) {
      await page.waitForFunction(() => document.getElementById("play").textContent === "Play" || Number(document.body.dataset.frame) >= 1);
      if (step === 0) await page.screenshot({ path: join(shots, `story_${number}.png`) });
      await page.locator("#story-next").click();
    }
    checks.that(`story ${number} ends in the free instrument`, !(await page.locator("#story").isVisible()));
    const problem = await page.locator("#problem").textContent();
    checks.that(`story ${number} has no error`, problem === "", problem);
  }
  if (await page.locator("#play").textContent() === "Pause") await page.locator("#play").click();
  await page.locator("#reset").click();
  // What a step's text claims.
  await page.locator("[data-story=photons]").click();
  for (let step = 0; step < 2; step += 1) await page.locator("#story-next").click();
  await shown(page, /^noise 0 /);
  // The list of the step before stays until the new design's is there.
  let share = "";
  for (let tries = 0; tries < 40 && !(Number.parseFloat(share) > 50); tries += 1) {
    if (tries > 0) await page.waitForTimeout(250);
    share = await page.locator(".noise-row", { hasText: "shot noise" }).locator("span").last().textContent();
  }
  checks.that("shot noise has most of the variance in its story", Number.parseFloat(share) > 50, share);
  await page.locator("#story-end").click();
  await page.locator("#reset").click();
  await page.locator("#size").selectOption("160");
  await page.locator("#tab-energy").click();
  await shown(page, /^energy /);
  // All at once: the next frame may come in between.
  const [power, ...sums] = await page.evaluate(() => {
    const number = (element) => Number.parseFloat(element.textContent);
    const sum = (host) => [...document.querySelectorAll(`#${host} .bar-row > span:last-child`)].reduce((all, one) => all + number(one), 0);
    return [number(document.querySelector("#energy-figures dd")), sum("energy-blocks"), sum("energy-rails")];
  });
  // Each is rounded to three digits.
  const adds = power > 0 && sums.every((sum) => Math.abs(sum / power - 1) < 0.01);
  checks.that("milliwatts by block and by rail add up to the power", adds, power, ...sums);
  const { interval } = await import(join(root, "web/dist/compare.js"));
  for (const [count, quantile] of [[2, 12.706], [6, 2.571], [31, 2.042]]) {
    const [middle, half] = interval(Array.from({ length: count }, (_, at) => at)), variance = (count * (count + 1)) / 12;
    const own = half / Math.sqrt(variance / count);
    const is = middle === (count - 1) / 2 && Math.abs(own - quantile) < 0.004;
    checks.that(`the interval of ${count} frames has Student's quantile`, is, own);
  }
  await page.locator("#tab-compare").click();
  await shown(page, /^compare /);
  await page.locator("#bits-value").fill("2");
  await page.locator("#bits-value").press("Enter");
  await page.locator("#step").click();
  await page.waitForFunction(() => /Means of 2 frames/.test(document.getElementById("compare-frames").textContent), undefined,
    { timeout: 60_000 });
  const text = await page.locator("#compare-text").textContent();
  checks.that("the comparison names what differs", text.includes("Depth"), text);
  const raw = await page.locator("#compare-rows tr", { hasText: "Raw bits" }).locator("td").allTextContents();
  checks.that("raw bits of ten and of two bits are five to one", Number(raw[0]) / Number(raw[1]) === 5, raw);
  await page.locator("#wiper").fill("30");
  await page.screenshot({ path: join(shots, "compare.png") });
  await context.close();
});

await checks.part("panels are accessible and fit, in light and dark, at three widths", async () => {
  for (const [width, height] of [[1440, 1100], [1024, 900], [390, 844]]) {
    for (const dark of [false, true]) {
      const { page, context, complaints } = await open(browser, server.address, { width, height, dark });
      await shown(page, /^pixel/);
      await page.locator(".menu summary").click();
      const menu = await page.locator(".menu-items").boundingBox();
      checks.that(`the downloads fit at ${width} px`, menu.x >= 0 && menu.x + menu.width <= width, menu);
      await page.locator(".menu summary").click();
      for (const tab of tabs) {
        await page.locator(`#tab-${tab}`).click();
        await shown(page, new RegExp(`^${tab} `));
        if (tab === "noise" && width === 1440) {
          await page.locator("#measure").click();
          await page.locator("#transfer-figures dd").first().waitFor({ timeout: 120_000 });
        }
        if (tab === "pose") for (let step = 0; step < 6; step += 1) await stepOnce(page);
        if (tab === "features") {
          await page.evaluate(() => document.getElementById("frame").focus());
        }
        await page.screenshot({ path: join(shots, `${tab}_${width}_${dark ? "dark" : "light"}.png`), fullPage: true });
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
        checks.that(`${tab} at ${width} px does not scroll sideways`, wide <= 0, wide);
        if (width === 1024) continue;
        await page.evaluate(axe);
        const found = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
        const serious = found.violations.filter((one) => ["serious", "critical"].includes(one.impact));
        checks.that(`axe finds nothing serious in ${tab} at ${width} px, ${dark ? "dark" : "light"}`, serious.length === 0,
          ...serious.map((one) => `${one.id}: ${one.nodes.map((node) => node.html).slice(0, 3).join(" ")}`));
      }
      checks.that("the console has no complaint", complaints.length === 0, complaints);
      await context.close();
    }
  }
});

async function stepOnce(page) {
  const frame = Number(await page.evaluate(() => document.body.dataset.frame));
  await page.locator("#step").click();
  await page.waitForFunction((before) => Number(document.body.dataset.frame) > before, frame, { timeout: 60_000 });
}

await browser.close();
server.close();
rmSync(folder, { recursive: true });
checks.end();
