//! Seven stories of one idea each. A step sets the design and the panel, says what to look at, and leaves the page free to use.
import type { Design } from "./design.js";

/** `other`: what design B has otherwise, where the step sets two side by side. */
export interface Step { text: string; design?: Design; other?: Design; tab: string; play?: boolean }
export interface Story { id: string; title: string; steps: Step[] }

const bright: Design = { lux: "2500", motion: "still", shutter: "global", exposure: "6", bits: "10", cds: "digital" };

/** Little light under a high gain: a few hundred electrons fill a fifth of the codes. */
const dim: Design = { ...bright, lux: "200", gain: "8" };

/** A few dozen electrons, read with a noise of two: shot noise is the largest part. */
const faint: Design = { ...bright, lux: "40", gain: "16", read: "20" };

/** The light and gain at which four grey values tell a room's surfaces apart. */
const sparse: Design = { ...bright, motion: "sway", gain: "2" };

/** Striped columns that pass. */
const turning: Design = { ...bright, motion: "spin", rate: "400", exposure: "0.5", lux: "12000" };

export const stories: Story[] = [
  { id: "photons", title: "Why counting photons is noisy", steps: [
    { text: "In good light a pixel gathers thousands of electrons, and the picture is clean. The cross marks the probed pixel; the panel " +
      "follows it from photons to its code. Click in the picture for another one.", design: bright, tab: "pixel" },
    { text: "Now the light falls to 40 lux, and gain 16 makes up for it. The scene has not changed, but each pixel gathers a few dozen " +
      "electrons, and their number is a matter of chance. Frames play: watch the same pixel's electrons change from frame to frame.",
      design: faint, tab: "pixel", play: true },
    { text: "Taken apart: shot noise, the chance in counting, has most of the variance. It is no fault of the sensor. Its standard " +
      "deviation is the square root of the count, so four times the light makes it half as large relative to the signal.",
      design: faint, tab: "noise" },
    { text: "Press Measure, below the list: the photon-transfer curve says the same. Variance grows in proportion to the signal, and the " +
      "slope is the system gain. Change the gain or the read noise and measure again.", tab: "noise" },
  ] },
  { id: "ramp", title: "What a ramp does", steps: [
    { text: "A column has one comparator and one counter. A ramp rises; the counter runs until the ramp passes the pixel's voltage. " +
      "The count is the pixel's code. Run the conversion, or drag the time by hand.", design: bright, tab: "pixel" },
    { text: "Four bits: the ramp has 15 steps only. The conversion is short, and the code is coarse.",
      design: { ...bright, bits: "4" }, tab: "pixel" },
    { text: "Twelve bits: 4,095 steps. The ramp takes 8.5 µs of the line, and the line has to be long enough for it.",
      design: { ...bright, bits: "12", hts: "1200" }, tab: "rows" },
    { text: "A ramp that rises slowly at first has its fine steps in the dark, where eyes and corners need them. Try gain and ramp shape.",
      design: { ...bright, bits: "8", ramp: "piecewise" }, tab: "pixel" },
    { text: "To run every ramp clock by clock takes long. So the simulator has a ladder: a formula gives the code at once, and the " +
      "clocks prove it. Press Measure and compare the last two rows: equal codes, but the clocks take the sensor far longer.",
      design: bright, tab: "ladder" },
  ] },
  { id: "leans", title: "Why the picture leans", steps: [
    { text: "The camera turns at 400° a second behind a global shutter. All rows see the same moment: upright edges stay upright.",
      design: turning, tab: "rows", play: true },
    { text: "A rolling shutter exposes each row one line later than the row above. The camera has turned meanwhile: edges lean.",
      design: { ...turning, shutter: "rolling" }, tab: "rows", play: true },
    { text: "A line of three times the length makes the lean three times as large. Each bar is a row's exposure; time runs to the right. " +
      "Look at the bars and at the picture together.",
      design: { ...turning, shutter: "rolling", hts: "2800" }, tab: "rows", play: true },
    { text: "Both at once: global on the left of the wiper, rolling on the right. Drag it: the top row is the same in both, and each row " +
      "below has moved a little further.", design: { ...turning, hts: "2800" }, other: { shutter: "rolling" }, tab: "compare" },
    { text: "Exposure does not change the lean. It blurs. Drag line length and exposure and compare.",
      design: { ...turning, lux: "500", exposure: "6", shutter: "rolling" }, tab: "rows", play: true },
  ] },
  { id: "cds", title: "What double sampling (CDS) removes", steps: [
    { text: "Resetting a pixel leaves a random voltage. Correlated double sampling, CDS, converts it first and counts down. Then it " +
      "converts the signal and counts up. What both share cancels. Drag the time and watch the counter turn.",
      design: dim, tab: "pixel" },
    { text: "Left of the wiper with CDS, right without. The reset noise stays, 469 µV or 47 electrons of it, and each column adds its " +
      "own offset: stripes. The extractor takes noise for corners.", design: dim, other: { cds: "none" }, tab: "compare" },
    { text: "The list shows what came in: reset noise (kTC) and column offset. Switch them off one by one and on again.",
      design: { ...dim, cds: "none" }, tab: "noise" },
  ] },
  { id: "two-bits", title: "Two bits are enough until dark", steps: [
    { text: "Ten bits in good light. The extractor finds its corners; each circle is one.", design: sparse, tab: "features", play: true },
    { text: "Two bits: four grey values. Hundreds of corners are still there, and the raw picture takes a fifth of the bits.",
      design: { ...sparse, bits: "2" }, tab: "features", play: true },
    { text: "In the dark the few steps hide everything. Raise the gain or the bits, and watch when corners come back.",
      design: { ...sparse, bits: "2", lux: "50" }, tab: "features", play: true },
  ] },
  { id: "leaves", title: "What leaves the chip", steps: [
    { text: "Rows and features share the link. Each bar is a packet on the lanes: rows are blue, features orange.",
      design: { ...bright, motion: "sway" }, tab: "features", play: true },
    { text: "Features only: the link is silent for most of the frame.", design: { ...bright, motion: "sway", link: "features" },
      tab: "features", play: true },
    { text: "A higher threshold keeps fewer corners and sends fewer bits. The tracker lives on what is left: see the pose.",
      design: { ...bright, motion: "sway", link: "features", threshold: "40", rig: "65.0" }, tab: "pose", play: true },
  ] },
  { id: "milliwatts", title: "Where the milliwatts go", steps: [
    { text: "Every block counts its events and its time. The bars are the mean power of each block of this very sensor.",
      design: { ...bright, motion: "sway" }, tab: "energy", play: true },
    { text: "Twelve bits: ramps run four times as long, and counters toggle more. Watch the converters.",
      design: { ...bright, motion: "sway", bits: "12", hts: "1200" }, tab: "energy", play: true },
    { text: "Features only: the link sends a small part of the bits, yet its bar hardly falls. Its lanes draw most of their power " +
      "whether they send or not. Open A / B and change what the link carries in design B: the table has the difference.",
      design: { ...bright, motion: "sway", link: "features" }, tab: "energy", play: true },
  ] },
];
