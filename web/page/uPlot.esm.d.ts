//! The part of uPlot that the page uses.
declare namespace uPlot {
  type AlignedData = (number | null)[][];
  interface Axis { stroke?: string; grid?: object; ticks?: object; label?: string; size?: number }
  interface Series { stroke?: string; width?: number; dash?: number[]; points?: object }
  interface Options {
    width: number; height: number; legend?: { show: boolean }; scales?: Record<string, object>; axes?: Axis[]; series: Series[];
  }
}
declare class uPlot {
  constructor(options: uPlot.Options, data: uPlot.AlignedData, host: HTMLElement);
  destroy(): void;
}
export default uPlot;
