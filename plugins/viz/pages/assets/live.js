// A growing map. The server sends complete states, and the page shows the newest. Text is never parsed as HTML.
class GrowingMap extends MapView {
  // The view keeps its extent until the map has outgrown it.
  take(run) {
    const before = this.extent;
    super.take(run);
    const { middle, radius } = this.extent, ratio = radius / (before?.radius ?? Infinity);
    if (before && norm(sub(middle, before.middle)) < 0.2 * before.radius && ratio < 1.15 && ratio > 0.6)
      this.extent = { ...before, floor: this.extent.floor };
    this.orbit?.aim(run.variants[0].up, this.extent);
    if (this.state) this.controls();
  }

  // Shows the newest frame.
  controls() {
    this.state.frame = Math.max(this.run.variants[0].frames.length - 1, 0);
  }

  update(run) {
    this.take(run);
    this.redraw();
  }
}

// Names of the counts of events.
const COUNTS = { initialized: "added", removed: "removed", moved: "boxes moved", merged: "merged", forgotten: "dropped", refused: "refused", rejected: "outliers" };

class LivePage {
  constructor() {
    this.find = id => document.getElementById(id);
    this.page = document.documentElement;
    this.page.classList.add("live");
    // a screen reader does not read an object that changes with each frame
    this.find("object").ariaLive = "off";
    this.listen();
    setInterval(() => this.tellPhase(), 1000);
  }

  listen() {
    const source = new EventSource(`events${location.search}`);
    source.onmessage = ({ data }) => {
      this.trouble = null;
      this.take(JSON.parse(data));
      // the server ends with the program
      if (this.state.phase === "ended") source.close();
    };
    source.onerror = () => {
      this.trouble = source.readyState === EventSource.CLOSED ? "refused" : "lost";
      this.tellPhase();
    };
  }

  take(state) {
    if (state.frames !== this.state?.frames) this.moved = performance.now();
    this.state = state;
    this.showMap(state.run);
    const { counts, newest } = state.notes, mapped = state.run.variants[0].objects, last = state.run.variants[0].frames.at(-1);
    document.title = document.querySelector("h1").textContent = state.title || "Live map";
    pairs(this.find("facts"), [["frames", state.frames], ["time stamp (s)", state.timestamp.toFixed(3)], ["objects", mapped.length],
      ["boxes in the frame", last?.[6].length ?? 0], ["boxes so far", state.boxes], ["cost", state.cost?.toPrecision(5) ?? "-"]]);
    pairs(this.find("counts"), Object.entries(counts).map(([name, count]) => [COUNTS[name] ?? name, count]));
    latencyChart(this.find("latencies"), state.latencies);
    list(this.find("notes"), newest.toReversed().map(([frame, text]) => `frame ${frame}: ${text}`));
    const more = state.waiting - state.undetermined.length;
    this.find("waiting").textContent = state.waiting ? "Variables without enough factors, and directions that no factor constrains:" : "No variable is undetermined.";
    list(this.find("undetermined"), more > 0 ? [...state.undetermined, `and ${more} more`] : state.undetermined);
    this.listObjects(mapped);
    this.tellPhase();
    Object.assign(this.page.dataset, { frames: state.frames, objects: mapped.length });
  }

  showMap(run) {
    if (this.map) return this.map.update(run);
    const { frames } = run.variants[0];
    if (this.map === undefined) {
      try {
        window.mapView = this.map = new GrowingMap(run);
        this.page.dataset.map = "webgl";
        return this.map.update(run);
      } catch (error) {
        this.map = null;
        this.page.dataset.map = "static";
        this.page.classList.remove("webgl");
        this.find("map").prepend(element("p", `The map cannot be drawn: ${error.message}.`, { class: "warning" }));
        this.find("images").replaceChildren(element("canvas"));
      }
    }
    if (frames.length) drawImage(this.find("images").firstChild, run.variants[0], { frame: frames.length - 1, selected: null }, pageStyle());
  }

  listObjects(objects) {
    const fixed = (numbers, digits) => numbers.map(x => x.toFixed(digits)).join(" ");
    const rows = objects.map(o => [o.key, o.class, o.boxes, fixed(o.estimate.slice(0, 3), 2), fixed(o.estimate.slice(7), 3)]);
    refill(this.find("objects").tBodies[0], rows, cells => {
      const row = element("tr");
      row.append(...cells.map((cell, i) => element("td", cell, i === 2 ? { class: "n" } : {})));
      return row;
    });
  }

  tellPhase() {
    const phase = this.state?.phase ?? "connecting", idle = Math.floor((performance.now() - this.moved) / 1000);
    const names = { connecting: "connecting", waiting: "waiting for the first frame", running: "running", solving: "all frames have arrived", ended: "ended",
      lost: "connection lost", refused: "refused" };
    const shown = phase === "ended" ? phase : this.trouble ?? phase;
    const words = { running: idle > 2 ? `no frame for ${idle} s` : "", solving: `solving all as one batch: ${this.state?.words}`, ended: this.state?.words,
      lost: "trying again; the page shows the last state that arrived", refused: "open the printed address with its token" };
    this.page.dataset.phase = shown;
    // a screen reader reads each change
    for (const [id, text] of [["phase", names[shown]], ["words", words[shown] ?? ""]])
      if (this.find(id).textContent !== text) this.find(id).textContent = text;
  }
}

// Replaces the children of a list only if their content has changed, so that a reader can select text.
function refill(parent, items, made) {
  const text = JSON.stringify(items);
  if (parent.shown === text) return;
  parent.shown = text;
  parent.replaceChildren(...items.map(made));
}

function list(parent, texts) {
  refill(parent, texts, text => element("li", text));
}

function pairs(parent, entries) {
  refill(parent, entries, ([name, value]) => {
    const pair = element("div");
    pair.append(element("dt", name), element("dd", value));
    return pair;
  });
}

window.livePage = new LivePage();
