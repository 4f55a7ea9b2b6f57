// A graph in 3D: variables as points and factors as lines, at the initial values and at the estimate.
class GraphView {
  constructor(graph) {
    this.find = id => document.getElementById(id);
    this.canvas = this.find("canvas");
    this.renderer = new Renderer(this.canvas);
    this.graph = graph;
    // each factor by its points, for the details of a variable
    this.factors = graph.points.map(() => []);
    graph.lines.forEach((line, i) => line.ends.forEach(end => this.factors[end].push(i)));
    const costs = graph.lines.map(line => line.cost).sort((a, b) => a - b);
    this.mostCost = Math.max(costs[Math.floor((costs.length - 1) * 0.99)] ?? 0, 1e-12);
    this.selected = null;
    this.show = {};
    const frames = graph.points.map(point => [0, 0, 0, 0, point.after]);
    this.extent = extent([{ up: [0, 0, 1], objects: [], frames }]);
    // room for the points beyond the 98 % that the extent holds
    this.extent.radius *= 1.2;
    if (!graph.named) document.querySelector("[data-show=names]").parentElement.remove();
    this.orbit = new Orbit(this.canvas, [0, 0, 1], this.extent, () => this.redraw(), (x, y) => this.tap(x, y), e => this.pressed(e));
    if (graph.planar) Object.assign(this.orbit.home, { azimuth: Math.PI / 2, height: 1.5 });
    this.orbit.reset();
    for (const box of document.querySelectorAll("[data-show]")) {
      const set = () => { this.show[box.dataset.show] = box.checked; };
      box.addEventListener("change", () => { set(); this.changed(); });
      set();
    }
    this.find("reset").addEventListener("click", () => this.orbit.reset());
    document.documentElement.classList.add("webgl");
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.changed());
    // at once, so that an error replaces the view
    this.build();
    this.draw();
    this.describe();
  }

  // Computes the shapes again after a change of what is shown.
  changed() {
    this.shapes = null;
    this.redraw();
  }

  redraw() {
    this.pending ??= requestAnimationFrame(() => { this.pending = null; this.draw(); });
  }

  build() {
    const { points, lines, colors } = this.graph, { show, selected } = this, style = pageStyle(), segments = new Segments();
    const [before, after, text] = [colors.before, colors.after, style.text].map(rgb);
    const draw = (place, color) => {
      const at = i => points[i][place];
      const isOfSelected = line => selected !== null && line.ends.includes(selected);
      if (show.factors) for (const line of lines) {
        const own = isOfSelected(line) ? text : show.cost && place === "after" ? ramp(line.cost / this.mostCost) : color;
        const look = [own, isOfSelected(line) ? 3 : show.cost ? 2 : 1.3, { dashed: line.outlier }];
        if (line.ends.length === 2) segments.add(at(line.ends[0]), at(line.ends[1]), ...look);
        else {
          const middle = scaled(line.ends.map(at).reduce(add), 1 / line.ends.length);
          for (const end of line.ends) segments.add(middle, at(end), ...look);
        }
      }
      // a point is a small cross; of many points, only one stroke
      const reach = (points.length > 3000 ? 0.002 : 0.006) * this.extent.radius;
      points.forEach((point, i) => {
        const strokes = points.length > 3000 ? 1 : 3, isMarked = i === selected;
        for (let k = 0; k < strokes; k++) {
          const arm = [0, 1, 2].map(c => (c === k ? reach * (isMarked ? 3 : 1) : 0));
          segments.add(sub(at(i), arm), add(at(i), arm), isMarked || point.fixed ? text : color, isMarked ? 3 : 2);
        }
      });
    };
    if (show.before) draw("before", before);
    if (show.after) draw("after", after);
    this.shapes = new Float32Array(segments.numbers);
  }

  draw() {
    if (!this.shapes) this.build();
    const style = pageStyle();
    this.renderer.resize();
    const { ratio } = this.renderer, { clientWidth: width, clientHeight: height } = this.canvas;
    const look = { camera: this.orbit.matrix(width / height), eye: this.orbit.eye, above: [0, 0, 1], paper: style.paper, dash: 0.02 * this.extent.radius };
    this.renderer.draw([0, 0, width, height].map(v => Math.round(v * ratio)), look, [], this.shapes);
    this.find("names").replaceChildren(...this.names(style));
    this.key();
    Object.assign(this.canvas.dataset, { selected: this.selected ?? "", drawn: +(this.canvas.dataset.drawn ?? 0) + 1 });
  }

  // Projects a point: x and y in CSS pixels of the canvas; null if it is behind the camera.
  project(point) {
    const { clientWidth: width, clientHeight: height } = this.canvas, m = this.orbit.matrix(width / height);
    const at = i => m[i] * point[0] + m[i + 4] * point[1] + m[i + 8] * point[2] + m[i + 12];
    return at(3) <= 0 ? null : [(at(0) / at(3) + 1) / 2 * width, (1 - at(1) / at(3)) / 2 * height];
  }

  // The places that are shown: the estimate if both are.
  get place() {
    return this.show.after || !this.show.before ? "after" : "before";
  }

  // The names of a small graph, and of the selected variable.
  names(style) {
    const { points, named } = this.graph;
    const shown = points.map((point, i) => [point, i]).filter(([, i]) => (named && this.show.names) || i === this.selected);
    return shown.flatMap(([point]) => {
      const at = this.project(point[this.place]);
      if (!at) return [];
      const span = element("span", point.key);
      Object.assign(span.style, { transform: `translate(${at[0] + 6}px, ${at[1] - 18}px)`, color: style.text });
      return [span];
    });
  }

  key() {
    const { colors, lines } = this.graph, { show } = this, list = [];
    const entry = (text, color, kind = "") => {
      const span = element("span"), mark = element("i", "", { class: kind });
      mark.style.borderColor = color;
      span.append(mark, text);
      list.push(span);
    };
    if (show.before) entry("initial values", colors.before);
    if (show.after && show.cost && show.factors) entry(`cost of the factors, 0 to ${this.mostCost.toPrecision(3)} or more`, "", "ramp");
    else if (show.after) entry("estimate", colors.after);
    if (show.factors && lines.some(line => line.outlier)) entry("factor with a weight below 0.5", colors.after, "dashed");
    this.find("key").replaceChildren(...list);
  }

  tap(x, y) {
    const near = this.graph.points.map((point, i) => {
      const at = this.project(point[this.place]);
      return [at ? Math.hypot(at[0] - x, at[1] - y) : Infinity, i];
    }).reduce((a, b) => (b[0] < a[0] ? b : a), [Infinity, null]);
    this.select(near[0] < 15 ? near[1] : null);
  }

  select(i) {
    this.selected = i;
    this.describe();
    this.changed();
  }

  pressed({ key }) {
    const n = this.graph.points.length, step = key === "n" ? 1 : key === "p" ? -1 : 0;
    if (step && n) this.select(((this.selected ?? (step > 0 ? -1 : n)) + step + n) % n);
    else if (key === "Escape") this.selected === null ? this.canvas.blur() : this.select(null);
    else return false;
    return true;
  }

  // The selected variable: its type, how far the solve has moved it, and its factors with the largest costs.
  describe() {
    const panel = this.find("object"), { points, lines } = this.graph;
    if (this.selected === null) {
      panel.replaceChildren(element("p", "Click a variable, or press n and p on the graph, to see its factors.", { class: "note" }));
      return;
    }
    const point = points[this.selected], table = element("table"), body = element("tbody");
    const row = (name, text) => {
      const line = element("tr");
      line.append(element("th", name, { scope: "row" }), element("td", text));
      body.append(line);
    };
    row("type", point.type + (point.fixed ? ", fixed" : ""));
    row("position", point.after.join(", "));
    row("moved by", norm(sub(point.after, point.before)).toPrecision(3));
    const own = this.factors[this.selected].map(i => lines[i]).sort((a, b) => b.cost - a.cost);
    for (const line of own.slice(0, 10)) row(`factor ${line.factor}`, `${line.name} (${line.ends.map(end => points[end].key).join(", ")}), cost ${line.cost.toPrecision(4)}`);
    if (own.length > 10) row("", `and ${own.length - 10} more`);
    table.append(body);
    panel.replaceChildren(element("h3", point.key), table);
  }
}

// Without WebGL 2, the picture from above remains, and its caption has the reason.
try {
  window.graphView = new GraphView(JSON.parse(document.getElementById("graph-data").textContent));
} catch (error) {
  document.documentElement.dataset.map = "static";
  document.documentElement.classList.remove("webgl");
  document.querySelector("#static-map figcaption")?.append(` (${error.message})`);
}
document.documentElement.dataset.map ??= "webgl";
