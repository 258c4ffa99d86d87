// The page shows the sensor's picture, at desktop and phone width, and follows its controls.
import { mkdirSync, writeFileSync } from "node:fs";
import { open, serve, start } from "./chromium.mjs";

const dist = new URL("../../web/dist/", import.meta.url).pathname;
const shots = new URL("../../target/check/", import.meta.url).pathname;
mkdirSync(shots, { recursive: true });
let passed = 0, failed = 0;
const expect = (what, holds) => {
  if (holds) passed += 1;
  else { failed += 1; console.log(`does not hold: ${what}`); }
};

const site = await serve(dist);
const browser = start();
try {
  for (const [name, width, height] of [["desktop", 1280, 900], ["phone", 390, 844]]) {
    const page = await open(browser, site.address, width, height);
    expect(`${name}: a first frame is shown`, await page.until("document.body.dataset.frame !== undefined", 20));
    const levels = await page.evaluate(`(() => { const c = document.getElementById("picture");
      const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data; return new Set(d).size; })()`);
    expect(`${name}: the picture has many grey levels (${levels})`, levels > 40);
    expect(`${name}: nothing is wider than the window`, await page.evaluate("document.documentElement.scrollWidth <= innerWidth"));
    const hash = "[...document.querySelectorAll('dd')].map((d) => d.textContent).join()";
    const before = await page.evaluate(hash);
    await page.evaluate(`(() => { const bits = document.getElementById("bits"); bits.value = 4;
      bits.dispatchEvent(new Event("input", { bubbles: true })); })()`);
    expect(`${name}: another depth gives another frame`, await page.until(`${hash} !== ${JSON.stringify(before)}`, 20));
    expect(`${name}: the state is in the address`, await page.evaluate("location.hash.includes('bits=4')"));
    writeFileSync(`${shots}page-${name}.png`, await page.screenshot());
  }
  const errors = browser.events.filter((event) => event.method === "Runtime.exceptionThrown" ||
    (event.method === "Log.entryAdded" && event.params.entry.level === "error" && !event.params.entry.url?.endsWith("favicon.ico")));
  expect(`no errors on the page: ${JSON.stringify(errors).slice(0, 400)}`, errors.length === 0);
} finally {
  await browser.close();
  site.close();
}
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed === 0 ? 0 : 1);
