// One time for all charts: a line at the frame that the map shows. A press on a chart moves the map to that time.
class TimeCursor {
  constructor(moved) {
    this.charts = [...document.querySelectorAll("svg[data-time]")].map(chart => {
      const panels = chart.dataset.panels.split(";").map(panel => panel.split(" ").map(Number));
      const [left, top, right, , from, to] = panels[0], bottom = panels.at(-1)[3];
      const line = document.createElementNS(chart.namespaceURI, "line");
      for (const [name, value] of Object.entries({ class: "cursor", y1: top, y2: bottom })) line.setAttribute(name, value);
      chart.append(line);
      const seconds = event => {
        const x = new DOMPoint(event.clientX, event.clientY).matrixTransform(chart.getScreenCTM().inverse()).x;
        return from + (x - left) / (right - left) * (to - from);
      };
      const follow = event => { if (event.buttons & 1) moved(seconds(event)); };
      chart.addEventListener("pointerdown", follow);
      chart.addEventListener("pointermove", follow);
      return { line, at: time => left + (time - from) / (to - from) * (right - left), left, right };
    });
  }

  show(seconds) {
    for (const { line, at, left, right } of this.charts) {
      const x = at(seconds), inside = x >= left - 0.5 && x <= right + 0.5;
      line.setAttribute("x1", x.toFixed(1));
      line.setAttribute("x2", x.toFixed(1));
      line.style.display = inside ? "" : "none";
    }
  }
}

