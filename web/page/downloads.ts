//! Files of what is on the page: frames, waveforms, a trace in the Chrome format, the report, the scenario.
import type { Summary } from "./simulator.js";

export function save(name: string, type: string, ...parts: BlobPart[]): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob(parts, { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

const table = Array.from({ length: 256 }, (_, byte) => {
  let value = byte;
  for (let bit = 0; bit < 8; bit += 1) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value >>> 0;
});

function crc(bytes: Uint8Array): number {
  let value = 0xffffffff;
  for (const byte of bytes) value = table[(value ^ byte) & 255]! ^ (value >>> 8);
  return (value ^ 0xffffffff) >>> 0;
}

function chunk(kind: string, body: Uint8Array): Uint8Array<ArrayBuffer> {
  const all = new Uint8Array(12 + body.length), view = new DataView(all.buffer);
  view.setUint32(0, body.length);
  all.set(new TextEncoder().encode(kind), 4);
  all.set(body, 8);
  view.setUint32(8 + body.length, crc(all.subarray(4, 8 + body.length)));
  return all;
}

/** Codes as a grey PNG of 16 bits, each code as it is. */
export async function png16(codes: Uint16Array, width: number, height: number): Promise<BlobPart[]> {
  const raw = new Uint8Array(height * (1 + 2 * width));
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const code = codes[y * width + x]!, at = y * (1 + 2 * width) + 1 + 2 * x;
      raw[at] = code >> 8;
      raw[at + 1] = code & 255;
    }
  }
  const packed = new Blob([raw]).stream().pipeThrough(new CompressionStream("deflate"));
  const body = new Uint8Array(await new Response(packed).arrayBuffer());
  const head = new Uint8Array(13), view = new DataView(head.buffer);
  view.setUint32(0, width);
  view.setUint32(4, height);
  head.set([16, 0, 0, 0, 0], 8);
  const magic = new Uint8Array([137, 80, 78, 71, 13, 10, 26, 10]);
  return [magic, chunk("IHDR", head), chunk("IDAT", body), chunk("IEND", new Uint8Array())];
}

interface Event { name: string; ph: string; pid: number; tid: number; ts?: number; dur?: number; args?: Record<string, unknown> }

/** Rows, converters, extractor, lanes and the host's stages of one frame as complete events, for Perfetto. */
export function chromeTrace(rows: Float64Array, packets: Float64Array, summary: Summary): string {
  const tracks = ["Exposure", "Storage", "Converters", "Link", "Frame", "This browser"];
  const events: Event[] = [{ name: "process_name", ph: "M", pid: 1, tid: 0, args: { name: "sensel sensor" } }];
  tracks.forEach((name, tid) => events.push({ name: "thread_name", ph: "M", pid: 1, tid: 1000 * tid, args: { name } }));
  const span = (name: string, tid: number, from: number, until: number, args: Record<string, unknown> = {}): void => {
    if (until > from) events.push({ name, ph: "X", pid: 1, tid, ts: from, dur: until - from, args });
  };
  // Rows overlap in time, and a track holds nested spans only: each row's exposure has its own track.
  for (let row = 0; row < rows.length / 6; row += 1) {
    const [start, end, read, done] = [0, 1, 2, 3].map((field) => rows[row * 6 + field]!) as [number, number, number, number];
    span(`row ${row}`, row, start, end, { row });
    span(`row ${row} stored`, row, end, read, { row });
    span(`row ${row}`, 2000, read, done, { row });
  }
  const kinds = ["short", "row", "features"];
  for (let at = 0; at < packets.length; at += 6) {
    const [kind, first, count, bytes, from, until] = packets.slice(at, at + 6) as unknown as number[];
    span(`${kinds[kind!]} ${first}`, 3000, from!, until!, { count, bytes });
  }
  const lanes = [...new Set(summary.timing.frame.map((phase) => phase.lane))];
  for (const { lane, name, start_us, end_us } of summary.timing.frame) {
    span(`${lane}: ${name}`, 4000 + lanes.indexOf(lane), start_us, end_us);
  }
  let at = 0;
  for (const [name, ms] of summary.stages_ms) {
    const us = (1000 * ms) / (summary.frame + 1);
    span(name, 5000, at, at + us);
    at += us;
  }
  const otherData = { version: summary.version, config: summary.config_hash };
  return JSON.stringify({ displayTimeUnit: "ns", traceEvents: events, otherData });
}
