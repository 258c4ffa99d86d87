// `node stage_times.mjs SCENARIO FRAMES STAGE...`: seconds of the stages of each frame in the page's WebAssembly, as JSON.
import { readFileSync } from "node:fs";
import { initSync, Session } from "../../web/dist/sensel_web.js";

const [scenario, frames, ...stages] = process.argv.slice(2);
globalThis.senselProgress = () => {};
initSync({ module: readFileSync(new URL("../../web/dist/sensel_web_bg.wasm", import.meta.url)) });
const session = new Session(readFileSync(scenario, "utf8")), times = [];
let before = stages.map(() => 0);
for (let frame = 0; frame < Number(frames); frame += 1) {
  session.step();
  const so_far = new Map(JSON.parse(session.summary()).stages_ms), now = stages.map((stage) => so_far.get(stage) / 1000);
  times.push(now.map((seconds, stage) => seconds - before[stage]));
  before = now;
}
console.log(JSON.stringify(times));
