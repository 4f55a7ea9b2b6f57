// The value of a chart's curve under the pointer: a dot on the nearest corner of a curve, and its x and y.
class ChartValues {
  constructor(chart) {
    this.chart = chart;
    this.panels = chart.dataset.panels.split(";").map(panel => {
      const [left, top, right, bottom, ...axes] = panel.split(" ").map(Number);
      const axis = ([low, high, log]) => share => log ? low * (high / low) ** share : low + share * (high - low);
      return { left, top, right, bottom, x: axis(axes.slice(0, 3)), y: axis(axes.slice(3)) };
    });
    [this.dot, this.text] = ["circle", "text"].map(name => document.createElementNS(chart.namespaceURI, name));
    for (const mark of [this.dot, this.text]) mark.setAttribute("class", "value");
    this.dot.setAttribute("r", 4);
    chart.append(this.dot, this.text);
    this.mark(null);
    chart.addEventListener("pointermove", event => this.mark(this.nearest(event)));
    chart.addEventListener("pointerleave", () => this.mark(null));
  }

  // Curves are open lines in a colour that is not the grid's. Their corners are read once.
  get curves() {
    return this.known ??= [...this.chart.querySelectorAll("path[fill=none]:not([d$=Z]):not([stroke='var(--grid)'])")].map(path => ({
      color: path.getAttribute("stroke"),
      corners: path.getAttribute("d").slice(1).split("L").map(corner => corner.split(" ").map(Number)),
    }));
  }

  // Returns the nearest corner in the panel under the pointer. Distances along x count ten times, so that a corner of each curve
  // at the pointer's x competes.
  nearest({ clientX, clientY }) {
    const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(this.chart.getScreenCTM().inverse());
    const panel = this.panels.find(p => x >= p.left && x <= p.right && y >= p.top && y <= p.bottom);
    if (!panel) return null;
    const away = ({ at }) => 10 * Math.abs(at[0] - x) + Math.abs(at[1] - y), isInside = at => at[1] >= panel.top - 1 && at[1] <= panel.bottom + 1;
    const corners = this.curves.flatMap(({ color, corners }) => corners.filter(isInside).map(at => ({ color, panel, at })));
    return corners.reduce((best, corner) => (best && away(best) <= away(corner) ? best : corner), null);
  }

  mark(found) {
    for (const mark of [this.dot, this.text]) mark.style.display = found ? "" : "none";
    if (!found) return;
    const { color, panel, at: [x, y] } = found, isRight = x > (panel.left + panel.right) / 2;
    this.dot.setAttribute("cx", x);
    this.dot.setAttribute("cy", y);
    this.dot.setAttribute("fill", color);
    this.text.setAttribute("x", isRight ? x - 8 : x + 8);
    this.text.setAttribute("y", Math.max(y - 8, panel.top + 12));
    this.text.setAttribute("text-anchor", isRight ? "end" : "start");
    const numbers = [panel.x((x - panel.left) / (panel.right - panel.left)), panel.y((panel.bottom - y) / (panel.bottom - panel.top))];
    // a tenth of a pixel is the accuracy of a corner
    this.text.textContent = numbers.map(value => Number(value.toPrecision(3))).join(", ");
  }
}

for (const chart of document.querySelectorAll("svg[data-panels]")) new ChartValues(chart);
