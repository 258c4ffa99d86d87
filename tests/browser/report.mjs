// Report and compare page as a reader opens them: from the disk, without a network, at desktop and phone, in light and dark, and on paper.
//
//   node tests/browser/report.mjs            # pictures go to target/check/report
import { execFileSync } from "node:child_process";
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { axe, launch, open, program, root } from "./browser.mjs";
import { Checks } from "./check.mjs";

const checks = new Checks();
const folder = join(root, "target/check/report");
rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
const sensel = (...words) => execFileSync(program(), [...words, "--quiet"], { cwd: root });
const small = ["--frames", "32", "--set", "sensor.width=320", "--set", "sensor.height=240"];
const [a, b, compared] = ["a", "b", "compared"].map((name) => join(folder, name));
sensel("run", "box", ...small, "--out", a);
sensel("run", "box", ...small, "--set", "sensor.adc.bits=6", "--out", b);
sensel("compare", a, b, "--out", compared);
const pages = { report: join(a, "report.html"), compare: join(compared, "compare.html"), waves: join(a, "waves.svg") };
// A4 pages that a report may fill: its sections, with no page of white between them.
const MOST_SHEETS = { report: 12, compare: 5 };

const browser = await launch();
for (const [name, path] of Object.entries(pages)) {
  for (const [width, height] of [[1440, 1000], [390, 844]]) {
    for (const dark of [false, true]) {
      const at = `${name} at ${width} px, ${dark ? "dark" : "light"}`;
      await checks.part(at, async () => {
        const { page, context, complaints, asked } = await open(browser, `file://${path}`, { width, height, dark });
        await page.screenshot({ path: join(folder, `${name}_${width}_${dark ? "dark" : "light"}.png`), fullPage: true });
        checks.that(`${at}: the console has no complaint`, complaints.length === 0, complaints);
        checks.that(`${at}: nothing is asked of a network`, asked.every((one) => /^(file|data|blob):/.test(one)), asked);
        if (name !== "waves") {
          const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
          checks.that(`${at} does not scroll sideways`, wide <= 0, wide);
          await page.evaluate(axe);
          const found = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
          const serious = found.violations.filter((one) => ["serious", "critical"].includes(one.impact));
          checks.that(`axe finds nothing serious in ${at}`, serious.length === 0,
            ...serious.map((one) => `${one.id}: ${one.nodes.map((node) => node.html).slice(0, 3).join(" ")}`));
        }
        await context.close();
      });
    }
  }
}
for (const [name, most] of Object.entries(MOST_SHEETS)) {
  await checks.part(`${name} on paper`, async () => {
    const { page, context } = await open(browser, `file://${pages[name]}`);
    const pdf = await page.pdf({ format: "A4", preferCSSPageSize: true });
    writeFileSync(join(folder, `${name}.pdf`), pdf);
    const sheets = pdf.toString("latin1").match(/\/Type\s*\/Page[^s]/g)?.length ?? 0;
    checks.that(`${name} takes 1 to ${most} sheets`, sheets >= 1 && sheets <= most, sheets);
    await context.close();
  });
}
await checks.part("the report links the picture of a row's conversions", async () => {
  const { page, context } = await open(browser, `file://${pages.report}`);
  checks.that("the link is there", await page.locator("a[href='waves.svg']").count() === 1);
  await context.close();
});
await browser.close();
checks.end();
