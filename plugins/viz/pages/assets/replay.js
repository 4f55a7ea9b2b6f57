// The map of a finished run, with controls for its variants and frames.
class Replay extends MapView {
  // On a wide screen the first and the last variant, otherwise the last.
  first() {
    const last = this.run.variants.length - 1;
    return last > 0 && window.innerWidth > 900 ? [0, last] : [last];
  }

  get frames() {
    return Math.max(...this.variants.map(v => v.frames.length), 1);
  }

  // The longest shown variant defines the time.
  get longest() {
    return this.variants.reduce((a, b) => (b.frames.length > a.frames.length ? b : a));
  }

  controls() {
    const { state } = this, bar = this.find("variants"), time = this.find("time");
    this.run.variants.forEach((variant, i) => {
      const button = element("button", variant.name, { "aria-pressed": state.active.includes(i) });
      button.addEventListener("click", () => {
        const others = state.active.filter(k => k !== i);
        if (state.active.includes(i) && !others.length) return;
        state.active = state.active.includes(i) ? others : [...others, i].sort((a, b) => a - b);
        button.setAttribute("aria-pressed", state.active.includes(i));
        this.panels();
      });
      bar.append(button);
    });
    const colors = new Map(this.run.variants.flatMap(v => v.objects).filter(o => o.estimate || o.truth).map(o => [o.class, o.color]));
    for (const [name, color] of [...colors].sort()) {
      const label = element("label"), box = element("input", "", { type: "checkbox", checked: "" }), swatch = element("i");
      swatch.style.background = color;
      box.addEventListener("change", () => this.showClass(name, box.checked));
      label.append(box, swatch, name || "no class");
      this.find("classes").append(label);
    }
    this.cursor = new TimeCursor(seconds => this.goToTime(seconds));
    if (this.run.variants.length < 2) this.find("overlay").style.display = "none";
    this.canvas.ariaLabel += " Comma and full stop go from frame to frame, space replays.";
    time.addEventListener("input", () => this.goTo(+time.value));
    this.find("play").addEventListener("click", () => this.play());
  }

  panels() {
    super.panels();
    this.find("time").max = this.frames - 1;
    this.goTo(Math.min(this.state.frame, this.frames - 1));
  }

  goTo(frame) {
    this.state.frame = Math.min(Math.max(frame, 0), this.frames - 1);
    this.find("time").value = this.state.frame;
    const { frames, every } = this.longest, seconds = frames[this.state.frame]?.[0];
    const thinned = every > 1 ? ` (every ${every}th is shown)` : "";
    this.find("clock").textContent = `frame ${this.state.frame * every}${seconds == null ? "" : `, ${seconds.toFixed(2)} s`}${thinned}`;
    if (seconds != null) this.cursor.show(seconds);
    this.redraw();
  }

  // Goes to the frame that is nearest to a time.
  goToTime(seconds) {
    const { frames } = this.longest, away = i => Math.abs(frames[i][0] - seconds);
    this.goTo(frames.reduce((best, _, i) => (away(i) < away(best) ? i : best), 0));
  }

  play() {
    const button = this.find("play"), begun = performance.now(), from = this.state.frame >= this.frames - 1 ? 0 : this.state.frame;
    this.playing = !this.playing;
    button.textContent = this.playing ? "⏸ pause" : "▶ replay";
    // the whole replay takes at most half a minute
    const rate = Math.max(15, this.frames / 30);
    const step = now => {
      if (!this.playing) return;
      this.goTo(from + Math.floor((now - begun) / 1000 * rate));
      if (this.state.frame < this.frames - 1) requestAnimationFrame(step);
      else this.play();
    };
    if (this.playing) requestAnimationFrame(step);
  }

  pressed(event) {
    const { key } = event;
    if (key === ".") this.goTo(this.state.frame + 1);
    else if (key === ",") this.goTo(this.state.frame - 1);
    else if (key === " ") this.play();
    else return super.pressed(event);
    return true;
  }
}

// Without WebGL 2, the picture from above remains, and its caption has the reason.
try {
  window.mapView = new Replay(JSON.parse(document.getElementById("run-data").textContent));
} catch (error) {
  document.documentElement.dataset.map = "static";
  document.documentElement.classList.remove("webgl");
  document.querySelector("#static-map figcaption")?.append(` (${error.message})`);
}
document.documentElement.dataset.map ??= "webgl";
