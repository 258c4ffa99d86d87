// Turns a chart's picture into one that zooms: drag over a span, double-click for the whole. The values stand in the figure.
(() => {
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const plot = (figure) => {
    const { x, y, series } = JSON.parse(figure.querySelector("script").textContent);
    const data = uPlot.join(series.map((one) => {
      const points = one.runs.flatMap((run, index) => (index > 0 ? [[0.5 * (one.runs[index - 1].at(-1)[0] + run[0][0]), null], ...run] : run));
      return [points.map((point) => point[0]), points.map((point) => point[1])];
    }));
    const axis = (label) => ({ label, stroke: colour("--soft"), grid: { stroke: colour("--grid"), width: 1 }, ticks: { stroke: colour("--rule"), width: 1 } });
    const inks = series.map((one) => ({ label: one.name, stroke: colour(one.ink), width: 2 }));
    const width = figure.clientWidth;
    const options = { width, height: Math.round(Math.max(240, 0.6 * width)), scales: { x: { time: false } }, axes: [axis(x), axis(y)],
      series: [{ label: x }, ...inks] };
    const chart = document.createElement("div");
    chart.className = "zoomed";
    figure.append(chart);
    new uPlot(options, data, chart);
    figure.classList.add("is-zoomed");
  };
  for (const figure of document.querySelectorAll("figure.chart[data-zooms]")) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "zoom";
    button.textContent = "Zoom";
    button.setAttribute("aria-label", "Zoom: " + figure.querySelector("title").textContent);
    button.addEventListener("click", () => {
      const old = figure.querySelector(".zoomed");
      if (!old) return void (plot(figure), (button.textContent = "Whole picture"));
      old.remove();
      figure.classList.remove("is-zoomed");
      button.textContent = "Zoom";
    });
    figure.append(button);
  }
})();
