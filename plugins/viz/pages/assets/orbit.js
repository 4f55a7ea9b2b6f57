// A camera that turns around a point, moved by mouse, fingers and keys.
class Orbit {
  constructor(canvas, up, { middle, radius }, changed, tapped, pressed) {
    Object.assign(this, { canvas, changed, tapped });
    this.pointers = new Map();
    this.aim(up, { middle, radius });
    canvas.addEventListener("pointerdown", event => this.down(event));
    canvas.addEventListener("pointermove", event => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, event => this.up_(event));
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("wheel", event => {
      // without the focus, the wheel scrolls the page
      if (document.activeElement !== canvas && !event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      this.zoom(Math.exp(0.0015 * event.deltaY * (event.deltaMode ? 20 : 1)));
    }, { passive: false });
    canvas.addEventListener("keydown", event => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (this.key(event) || pressed(event)) event.preventDefault();
    });
  }

  // Sets the home view, which shows the whole map, and uses it until the user moves the map.
  aim(up, { middle, radius }) {
    Object.assign(this, { up, reach: radius, home: { target: middle, distance: 2.35 * radius, azimuth: -0.9, height: 0.65 } });
    if (!this.moved) this.reset();
  }

  reset() {
    Object.assign(this, { ...this.home, moved: false });
    this.changed();
  }

  // Looks at a sphere, from the same side as before.
  fit({ middle, radius }) {
    Object.assign(this, { target: middle, distance: 2.35 * radius });
    this.turned();
  }

  turned() {
    this.moved = true;
    this.changed();
  }

  get eye() {
    const [right, ahead] = level(this.up), flat = Math.cos(this.height);
    const away = add(add(scaled(right, flat * Math.sin(this.azimuth)), scaled(ahead, -flat * Math.cos(this.azimuth))),
      scaled(this.up, Math.sin(this.height)));
    return add(this.target, scaled(away, this.distance));
  }

  matrix(aspect) {
    // a narrow view shows as much as a wide one
    const fovy = aspect < 1 ? 2 * Math.atan(Math.tan(0.39) / Math.max(aspect, 0.4)) : 0.78;
    const far = this.distance + 20 * this.reach;
    return product(perspective(fovy, aspect, Math.max(this.distance / 200, far / 1e5), far), lookAt(this.eye, this.target, this.up));
  }

  turn(dx, dy) {
    this.azimuth -= 0.008 * dx;
    this.height = Math.min(Math.max(this.height + 0.008 * dy, -1.5), 1.5);
    this.turned();
  }

  pan(dx, dy) {
    const ahead = unit(sub(this.target, this.eye)), right = unit(cross(ahead, this.up)), above = cross(right, ahead);
    const metres = 0.9 * this.distance / this.canvas.clientHeight;
    this.target = add(this.target, add(scaled(right, -dx * metres), scaled(above, dy * metres)));
    this.turned();
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.02 * this.reach), 20 * this.reach);
    this.turned();
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    // a finger gives the map the focus by a tap: until then, a swipe scrolls the page
    if (event.pointerType !== "touch") this.canvas.focus({ preventScroll: true });
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    this.travelled = this.pointers.size > 1 ? Infinity : 0;
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY], [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    this.travelled += Math.hypot(dx, dy);
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    if (other) {
      const gap = p => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
      this.zoom(gap(before) / gap(now));
      this.pan(dx / 2, dy / 2);
    } else if (event.buttons & 2 || event.shiftKey) {
      this.pan(dx, dy);
    } else {
      this.turn(dx, dy);
    }
  }

  up_(event) {
    if (this.pointers.delete(event.pointerId) && this.travelled < 5 && event.type === "pointerup") {
      this.canvas.focus({ preventScroll: true });
      this.tapped(event.offsetX, event.offsetY);
    }
  }

  key({ key, shiftKey }) {
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
    if (arrow) shiftKey ? this.pan(-30 * arrow[0], -30 * arrow[1]) : this.turn(-12 * arrow[0], -12 * arrow[1]);
    else if (key === "+" || key === "=") this.zoom(0.85);
    else if (key === "-") this.zoom(1 / 0.85);
    else if (key === "Home") this.reset();
    else return false;
    return true;
  }
}
