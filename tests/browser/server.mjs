// Serves one folder on loopback, as a static host does: compressed, cross-origin isolated, nothing cached.
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { gzipSync } from "node:zlib";

const types = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm", ".txt": "text/plain" };

/** Port 0: any that is free. `bytes` counts what went out, by path. */
export async function serve(folder, port = 0) {
  const bytes = new Map(), packed = new Map();
  const server = createServer((request, response) => {
    const asked = normalize(new URL(request.url, "http://localhost").pathname);
    const path = asked === "/" ? "/index.html" : asked;
    try {
      let body = packed.get(path);
      if (!body) packed.set(path, body = gzipSync(readFileSync(join(folder, path)), { level: 9 }));
      bytes.set(path, body.length);
      response.writeHead(200, { "content-type": types[extname(path)] ?? "application/octet-stream", "content-encoding": "gzip",
        "cross-origin-opener-policy": "same-origin", "cross-origin-embedder-policy": "require-corp", "cache-control": "no-cache" });
      response.end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(port, "127.0.0.1", done));
  return { address: `http://127.0.0.1:${server.address().port}/`, bytes, close: () => server.close() };
}
