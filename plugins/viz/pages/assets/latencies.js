// The latencies of the newest frames, on a logarithmic axis.
const LEVELS = [["p50", "#2a85d8"], ["p99", "#c8702a"], ["max", "#d7373f"]];

function svg(name, attributes, text = "") {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

function latencyChart(panel, latencies) {
  const { ms } = latencies, [width, height, left, right, top, bottom] = [560, 200, 44, 110, 10, 22];
  if (!ms.length) return panel.replaceChildren(element("p", "No frame yet.", { class: "note" }));
  const logs = ms.map(x => Math.log10(Math.max(x, 1e-3)));
  const low = Math.floor(Math.min(...logs)), high = Math.max(Math.ceil(Math.max(...logs)), low + 1);
  const x = i => left + (width - left - right) * (ms.length > 1 ? i / (ms.length - 1) : 0.5);
  const y = log => top + (height - top - bottom) * (high - log) / (high - low);
  const told = LEVELS.map(([name]) => `${name} ${latencies[name].toPrecision(3)} ms`);
  const chart = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `latency of the last ${ms.length} frames: ${told.join(", ")}` });
  for (let power = low; power <= high; power++) {
    chart.append(svg("line", { x1: left, x2: width - right, y1: y(power), y2: y(power), stroke: "var(--grid)" }),
      svg("text", { x: left - 6, y: y(power) + 4, "text-anchor": "end" }, `${+(10 ** power).toPrecision(1)}`));
  }
  chart.append(svg("text", { x: left, y: height - 4 }, `ms, the last ${ms.length} frame${ms.length > 1 ? "s" : ""}`));
  chart.append(svg("polyline", { points: logs.map((log, i) => `${x(i).toFixed(1)},${y(log).toFixed(1)}`).join(" "), fill: "none", stroke: "var(--text)", "stroke-width": 1.2, "stroke-linejoin": "round" }));
  // labels that would overlap move apart, the largest level on top
  let free = -Infinity;
  for (const [i, [name, color]] of [...LEVELS.entries()].reverse()) {
    const at = y(Math.log10(Math.max(latencies[name], 1e-3)));
    free = Math.max(at + 4, free + 14);
    chart.append(svg("line", { x1: left, x2: width - right, y1: at, y2: at, stroke: color, "stroke-dasharray": "5 4", "stroke-width": 1.4 }),
      svg("text", { x: width - right + 6, y: free }, told[i]));
  }
  panel.replaceChildren(chart);
}
