// Chromium under playwright-core, which ./check installs into target/browser.
import { createRequire } from "node:module";
import { existsSync, readFileSync } from "node:fs";

export const root = new URL("../../", import.meta.url).pathname;
const require = createRequire(`${root}target/browser/`);
const { chromium } = require("playwright-core");

export const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

/** Debian's Chromium, or the one that SENSEL_CHROMIUM names. */
export function launch() {
  const executablePath = process.env.SENSEL_CHROMIUM ?? "/usr/bin/chromium";
  return chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu", "--disable-quic"] });
}

/** The native program: the release build, or the one that SENSEL_PROGRAM names. */
export function program() {
  const path = process.env.SENSEL_PROGRAM ?? `${root}target/release/sensel`;
  if (!existsSync(path)) throw new Error(`${path} is not there; build it with cargo build --release`);
  return path;
}

/** A page of this size and theme on an address; complaints of the console are collected. */
export async function open(browser, address, { width = 1440, height = 1000, dark = false, downloads = true } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme: dark ? "dark" : "light", acceptDownloads: downloads,
    permissions: ["clipboard-read", "clipboard-write"] });
  const page = await context.newPage();
  const complaints = [], asked = [];
  page.on("console", (message) => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => asked.push(request.url()));
  // Blocks of the main thread that are longer than 50 ms, from the start on.
  await page.addInitScript(() => {
    globalThis.blocks = [];
    new PerformanceObserver((list) => globalThis.blocks.push(...list.getEntries().map((entry) => entry.duration)))
      .observe({ type: "longtask", buffered: true });
  });
  await page.goto(address);
  return { page, context, complaints, asked };
}

/** Waits until a frame is shown, and the panel with it. */
export async function shown(page, words = /./, seconds = 60) {
  const told = (pattern) => new RegExp(pattern).test(document.body.dataset.shown ?? "") && document.body.dataset.frame !== undefined;
  await page.waitForFunction(told, words.source, { timeout: 1000 * seconds });
}
