//! The library that draws curves: loaded after the first picture, which needs none.

let library: Promise<typeof import("./uPlot.esm.js")> | undefined;

/** uPlot, loaded once. */
export async function plots(): Promise<typeof import("./uPlot.esm.js").default> {
  library ??= import("./uPlot.esm.js");
  return (await library).default;
}
