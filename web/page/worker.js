// Runs the simulator off the page's thread: one message in, one frame out.
import init, { Session } from "./sensel_web.js";

let session = null;
const ready = init();

onmessage = async ({ data }) => {
  await ready;
  try {
    if (data.scenario !== undefined) {
      session?.free();
      session = new Session(data.scenario);
    }
    const started = performance.now();
    const frame = session.step();
    const pixels = frame.pixels();
    const features = frame.features();
    const answer = { id: data.id, width: frame.width, height: frame.height, pixels, features,
      summary: JSON.parse(frame.summary()), milliseconds: performance.now() - started };
    frame.free();
    postMessage(answer, [pixels.buffer, features.buffer]);
  } catch (error) {
    postMessage({ id: data.id, error: String(error.message ?? error) });
  }
};
