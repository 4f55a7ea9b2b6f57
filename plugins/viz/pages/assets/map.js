// The map: variants side by side under one camera, one of their frames, and a picked object.
class MapView {
  constructor(run) {
    this.find = id => document.getElementById(id);
    this.canvas = this.find("canvas");
    this.renderer = new Renderer(this.canvas);
    this.take(run);
    this.state = { frame: 0, selected: null, show: {}, hidden: new Set(), hiddenObjects: new Set(), active: this.first() };
    this.orbit = new Orbit(this.canvas, run.variants[0].up, this.extent, () => this.redraw(), (x, y) => this.tap(x, y), e => this.pressed(e));
    for (const box of document.querySelectorAll("[data-show]")) {
      const set = () => { this.state.show[box.dataset.show] = box.checked; };
      box.addEventListener("change", () => { set(); this.redraw(); });
      set();
    }
    this.find("fit").addEventListener("click", () => {
      const around = objectsExtent(this.variants);
      if (around) this.orbit.fit(around);
    });
    this.canvas.addEventListener("dblclick", () => {
      const picked = this.variants.flatMap(v => v.objects).find(o => o.estimate && o.id === this.state.selected);
      if (picked) this.orbit.fit({ middle: picked.estimate.slice(0, 3), radius: 4 * Math.max(...picked.estimate.slice(7)) });
    });
    this.find("reset").addEventListener("click", () => this.orbit.reset());
    this.find("unhide").addEventListener("click", () => this.showHiddenObjects());
    this.controls();
    document.documentElement.classList.add("webgl");
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
    this.panels();
    // at once, so that an error replaces the map
    this.draw();
  }

  // Sets the data of the map.
  take(run) {
    this.run = run;
    this.extent = extent(run.variants);
    this.mostError = run.variants.flatMap(v => v.frames).reduce((most, f) => Math.max(most, f[5] ?? 0), 1e-9);
    this.mostObjectError = run.variants.flatMap(v => v.objects).reduce((most, o) => Math.max(most, o.estimate && o.error ? o.error[0] : 0), 1e-9);
  }

  // Indices of the variants that are shown at first.
  first() {
    return [0];
  }

  // Adds the controls of a derived class.
  controls() {}

  // Replaces the panels below the map after a change of the variants or of the window.
  panels() {
    this.find("images").replaceChildren(...this.variants.map(() => element("canvas")));
    this.redraw();
  }

  get variants() {
    return this.state.active.map(i => this.run.variants[i]);
  }

  isShown({ id, class: name }) {
    return !this.state.hidden.has(name) && !this.state.hiddenObjects.has(id);
  }

  // Returns the objects of a variant that are shown.
  objects(variant) {
    return variant.objects.filter(o => this.isShown(o));
  }

  showClass(name, isShown) {
    isShown ? this.state.hidden.delete(name) : this.state.hidden.add(name);
    const { selected } = this.state;
    if (selected !== null && !this.variants.some(v => this.objects(v).some(o => o.id === selected))) this.state.selected = null;
    this.redraw();
  }

  hideSelected() {
    if (this.state.selected === null) return;
    this.state.hiddenObjects.add(this.state.selected);
    this.find("unhide").hidden = false;
    this.select(null);
  }

  showHiddenObjects() {
    this.state.hiddenObjects.clear();
    this.find("unhide").hidden = true;
    this.redraw();
  }

  select(id) {
    this.state.selected = id;
    this.redraw();
  }

  pressed({ key }) {
    const ids = [...new Set(this.variants.flatMap(v => this.objects(v).filter(o => o.estimate).map(o => o.id)))];
    const next = step => ids.length && this.select(ids[(ids.indexOf(this.state.selected) + step + ids.length + (step < 0 && this.state.selected === null ? 1 : 0)) % ids.length]);
    if (key === "n") next(1);
    else if (key === "p") next(-1);
    else if (key === "h") this.hideSelected();
    else if (key === "Escape") this.state.selected === null ? this.canvas.blur() : this.select(null);
    else return false;
    return true;
  }

  // The variants of each part of the canvas: all in one, or one in each.
  groups() {
    return this.state.show.overlay ? [this.state.active] : this.state.active.map(i => [i]);
  }

  // Rectangles of the parts on the canvas, in CSS pixels from its upper left corner: side by side, or below each other.
  parts() {
    const { clientWidth: width, clientHeight: height } = this.canvas, n = this.groups().length;
    const beside = width / n >= 0.7 * height / 1.2 || n === 1;
    return this.groups().map((_, i) => beside
      ? [Math.round(i * width / n), 0, Math.round((i + 1) * width / n) - Math.round(i * width / n) - (i < n - 1 ? 1 : 0), height]
      : [0, Math.round(i * height / n), width, Math.round((i + 1) * height / n) - Math.round(i * height / n) - (i < n - 1 ? 1 : 0)]);
  }

  // Projects a point into a part: x and y in CSS pixels of the canvas; null if it is behind the camera.
  project(point, [x, y, width, height]) {
    const m = this.orbit.matrix(width / height), at = i => m[i] * point[0] + m[i + 4] * point[1] + m[i + 8] * point[2] + m[i + 12];
    return at(3) <= 0 ? null : [x + (at(0) / at(3) + 1) / 2 * width, y + (1 - at(1) / at(3)) / 2 * height];
  }

  tap(x, y) {
    const i = this.parts().findIndex(([left, top, width, height]) => x >= left && y >= top && x <= left + width && y <= top + height);
    if (i < 0) return;
    const [left, top, width, height] = this.parts()[i], { eye, target, up } = this.orbit, m = this.orbit.matrix(width / height);
    const ahead = unit(sub(target, eye)), right = unit(cross(ahead, up)), above = cross(right, ahead);
    // the field of view, from the matrix: its first numbers are those of the perspective times unit vectors
    const wide = 1 / Math.hypot(m[0], m[4], m[8]), high = 1 / Math.hypot(m[1], m[5], m[9]);
    const direction = add(ahead, add(scaled(right, (2 * (x - left) / width - 1) * wide), scaled(above, (1 - 2 * (y - top) / height) * high)));
    const hits = this.groups()[i].flatMap(k => this.objects(this.run.variants[k])).filter(o => o.estimate).map(o => [meets(o.estimate, eye, direction), o.id]).sort((a, b) => a[0] - b[0]);
    this.select(hits.length && hits[0][0] < Infinity ? hits[0][1] : null);
  }

  redraw() {
    this.pending ??= requestAnimationFrame(() => { this.pending = null; this.draw(); });
  }

  draw() {
    const style = pageStyle();
    this.renderer.resize();
    const { ratio } = this.renderer, height = this.canvas.clientHeight, names = [];
    this.parts().forEach((part, i) => {
      const [x, y, width, high] = part, below = [x, height - y - high, width, high].map(v => Math.round(v * ratio));
      const look = { camera: this.orbit.matrix(width / high), eye: this.orbit.eye, above: unit(this.orbit.up), paper: style.paper, dash: 0.05 * this.extent.radius };
      const group = this.groups()[i].map(k => this.run.variants[k]), all = group.map((variant, place) => this.shapes(variant, style, place));
      this.renderer.draw(below, look, all.flatMap(s => s.ellipsoids), all.flatMap(s => s.segments));
      names.push(...this.names(group, part, all[0].gravity, style));
    });
    this.find("names").replaceChildren(...names);
    this.key(style);
    [...this.find("images").children].forEach((canvas, i) => {
      const variant = this.variants[i];
      if (variant.frames[this.state.frame]) drawImage(canvas, variant, this.state, style, o => this.isShown(o));
    });
    // a screen reader reads it after a change, and not if only the camera turns
    const { selected, frame, active } = this.state, told = [selected, frame, active].join();
    if (this.told !== told) describe(this.find("object"), this.variants, selected, frame, () => this.hideSelected());
    this.told = told;
    Object.assign(this.canvas.dataset, { selected: this.state.selected ?? "", frame: this.state.frame, drawn: +(this.canvas.dataset.drawn ?? 0) + 1 });
  }

  // Returns the shapes of a variant. In an overlay, the first variant is solid, and the others are rings in a colour of their own.
  shapes(variant, style, place = 0) {
    const { show, frame, selected } = this.state, { frames, camera } = variant, segments = new Segments();
    const [odometry, estimate, truth] = [this.run.colors.odometry, this.overlayColor(place), style.text].map(rgb);
    const depth = 0.09 * this.extent.radius, gravity = show.grid && place === 0 ? ground(segments, variant.up, this.extent, style.grid).gravity : null;
    if (show.truth && place === 0) segments.path(frames.map(f => f[1]), 2, () => truth, true);
    if (show.odometry && place === 0) segments.path(frames.map(f => f[2]), 2, () => odometry);
    const most = this.mostError;
    segments.path(frames.map(f => f[4]), show.error ? 5 : 3, i => show.error && frames[i][5] != null ? ramp(frames[i][5] / most) : estimate);
    const each = Math.max(1, Math.round(frames.length / 16));
    if (show.frusta && place === 0) frames.forEach((f, i) => { if (i % each === 0) segments.frustum(f[4], camera, 0.6 * depth, estimate.map(c => 0.5 * c + 0.5 * style.paper[0]), 1); });
    const now = frames[frame];
    if (now) segments.frustum(now[4], camera, 1.6 * depth, estimate, 2.5);
    const ellipsoids = [];
    for (const object of this.objects(variant)) {
      const color = show.error && object.error ? ramp(object.error[0] / this.mostObjectError) : rgb(object.color);
      if (object.estimate && place > 0) segments.rings(object.estimate, show.error ? color : estimate, object.id === selected ? 3 : 1.6);
      else if (object.estimate) ellipsoids.push(...axes(object.estimate).flat(), ...object.estimate.slice(0, 3), ...color, object.id === selected ? 1 : 0);
      if (object.truth && show.truth && place === 0) segments.cuboid(object.truth, object.id === selected ? truth : color, object.id === selected ? 2 : 1.3);
      if (object.estimate && now && (selected === null || selected === object.id) && now[6].some(box => box[0] === object.id))
        segments.add(now[4], object.estimate, color.map((c, i) => 0.6 * c + 0.4 * style.paper[i]), 1, { dashed: true });
    }
    return { ellipsoids, segments: segments.numbers, gravity };
  }

  // Colours of the variants of an overlay: the first has the colour of every estimate.
  overlayColor(place) {
    return [this.run.colors.estimate, "#d6336c", "#2b9e55", "#c08a0e", "#7b61d9"][place % 5];
  }

  // The names of objects that fit, nearest first, and the names of the variants.
  names(group, part, gravity, style) {
    const [variant] = group;
    const [left, top, width, height] = part, taken = [], spans = [];
    const put = (text, [x, y], color, kind = "") => {
      const box = [x, y - 8, x + 7 * text.length, y + 8];
      const free = !taken.some(t => box[0] < t[2] && t[0] < box[2] && box[1] < t[3] && t[1] < box[3]);
      if (!free || box[0] < left || box[2] > left + width || box[1] < top || box[3] > top + height) return;
      taken.push(box);
      const span = element("span", text, { class: kind });
      Object.assign(span.style, { transform: `translate(${x}px, ${y - 9}px)`, color });
      spans.push(span);
    };
    put(group.map(v => v.name).join(", ").slice(0, Math.floor(width / 8)), [left + 10, top + 16], style.text, "title");
    const { eye } = this.orbit, away = o => norm(sub(o.estimate, eye));
    const mapped = this.objects(variant).filter(o => o.estimate).sort((a, b) => (b.id === this.state.selected) - (a.id === this.state.selected) || away(a) - away(b));
    if (this.state.show.names) for (const object of mapped) {
      const at = this.project(object.estimate, part);
      if (at) put(object.class, [at[0] - 3.5 * object.class.length, at[1]], style.text);
    }
    const at = gravity && this.project(gravity, part);
    if (at) put("gravity", [at[0] + 6, at[1]], style.text);
    return spans;
  }

  key(style) {
    const { show } = this.state, known = this.run.variants.some(v => v.frames.some(f => f[1]));
    const entry = (text, color, kind = "") => {
      const span = element("span"), mark = element("i", "", { class: kind });
      mark.style.borderColor = color;
      span.append(mark, text);
      return span;
    };
    const list = [];
    if (known && show.truth) list.push(entry("true path; cuboids are true objects", style.text, "dashed"));
    if (show.odometry) list.push(entry("odometry", this.run.colors.odometry));
    if (show.error && known) list.push(entry(`error of the estimated path, 0 to ${this.mostError.toPrecision(3)} m`, "", "ramp"));
    else if (show.overlay && this.variants.length > 1) this.variants.forEach((v, place) => list.push(entry(place ? `${v.name} (rings)` : `${v.name} (solid)`, this.overlayColor(place))));
    else list.push(entry("estimated", this.run.colors.estimate));
    if (show.error && this.run.variants.some(v => v.objects.some(o => o.error))) list.push(entry(`position error of the objects, 0 to ${this.mostObjectError.toPrecision(3)} m`, "", "ramp"));
    this.find("key").replaceChildren(...list);
  }
}

