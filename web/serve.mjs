// `node web/serve.mjs [PORT]`: serves web/dist on loopback, compressed, and cross-origin isolated.
import { serve } from "../tests/browser/server.mjs";

const { address } = await serve(new URL("dist/", import.meta.url).pathname, Number(process.argv[2] ?? 8080));
console.log(address);
