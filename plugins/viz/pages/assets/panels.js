// The panels beside the map: the images of a frame, and the details of an object. Text is never parsed as HTML.
function element(name, text = "", attributes = {}) {
  const made = document.createElement(name);
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// The colours of the page, which follow its theme.
function pageStyle() {
  const variable = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  return { paper: rgb(variable("paper")), text: variable("text"), grid: rgb(variable("grid")), faint: variable("faint") };
}

// One image of a variant: measured boxes dashed, estimated outlines filled, the boxes around these thin.
function drawImage(canvas, variant, { frame, selected }, style, isShown = () => true) {
  const [, , , , width, height] = variant.camera, shown = Math.max(canvas.clientWidth, 200);
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  canvas.width = Math.round(shown * ratio);
  canvas.height = Math.round(Math.min(shown * height / width, 2 * shown) * ratio);
  const draw = canvas.getContext("2d"), byId = new Map(variant.objects.map(o => [o.id, o]));
  draw.scale(canvas.width / width, canvas.height / height);
  const pixel = width / canvas.width * ratio;
  draw.font = `${12 * pixel}px system-ui, sans-serif`;
  const taken = [];
  for (const [id, [xmin, ymin, xmax, ymax], ellipse, label] of variant.frames[frame][6]) {
    const object = byId.get(id), color = object?.color ?? style.text, bold = id === selected ? 2 : 1;
    if (object && !isShown(object)) continue;
    Object.assign(draw, { strokeStyle: color, fillStyle: color });
    if (ellipse) {
      const [u, v, uu, uv, vv] = ellipse, turn = 0.5 * Math.atan2(2 * uv, uu - vv);
      const half = (uu + vv) / 2, apart = Math.hypot((uu - vv) / 2, uv);
      draw.beginPath();
      draw.ellipse(u, v, Math.sqrt(half + apart), Math.sqrt(Math.max(half - apart, 0)), turn, 0, 2 * Math.PI);
      draw.globalAlpha = 0.18;
      draw.fill();
      draw.globalAlpha = 1;
      draw.lineWidth = 1.8 * bold * pixel;
      draw.stroke();
      draw.lineWidth = 0.7 * bold * pixel;
      draw.strokeRect(u - Math.sqrt(uu), v - Math.sqrt(vv), 2 * Math.sqrt(uu), 2 * Math.sqrt(vv));
    }
    draw.lineWidth = 1.5 * bold * pixel;
    draw.setLineDash([6 * pixel, 4 * pixel]);
    draw.strokeRect(xmin, ymin, xmax - xmin, ymax - ymin);
    draw.setLineDash([]);
    // a name that would overlap another is omitted; the map has its colour
    const name = label ?? object?.class ?? "", left = Math.max(xmin, 0) + 2 * pixel, wide = draw.measureText(name).width;
    const below = [Math.max(ymin - 3 * pixel, 12 * pixel), ymax + 13 * pixel].find(y =>
      !taken.some(t => left < t[2] && t[0] < left + wide && y - 12 * pixel < t[3] && t[1] < y));
    if (below === undefined) continue;
    taken.push([left, below - 12 * pixel, left + wide, below]);
    draw.fillText(name, left, below);
  }
}

// The details of an object, with a column for each shown variant, and a button that hides it.
function describe(panel, variants, id, frame, hide) {
  panel.replaceChildren();
  const found = variants.map(v => v.objects.find(o => o.id === id)), any = found.find(Boolean);
  if (!any) {
    panel.append(element("p", "Click an object, or press n and p on the map, to see its class, semi-axes, rule, factors and residuals.", { class: "note" }));
    return;
  }
  const heading = element("h3", "");
  const swatch = element("span", "", { class: "swatch" });
  swatch.style.background = any.color;
  const button = element("button", "hide", { "aria-label": `hide ${any.class} ${any.key}` });
  button.addEventListener("click", hide);
  heading.append(swatch, `${any.class} (${any.key}) `, button);
  const table = element("table"), body = element("tbody");
  const row = (name, of) => {
    const cells = found.map(o => (o && of(o)) ?? "-");
    if (cells.every(cell => cell === "-")) return;
    const line = element("tr");
    line.append(element("th", name, { scope: "row" }), ...cells.map(cell => element("td", cell)));
    body.append(line);
  };
  if (variants.length > 1) {
    const line = element("tr");
    line.append(element("td"), ...variants.map(v => element("th", v.name, { scope: "col" })));
    body.append(line);
  }
  const lengths = shape => shape?.slice(7).sort((a, b) => b - a).map(x => x.toFixed(3)).join(" × ");
  const residual = f => f.residual.length ? `, r = (${f.residual.join(", ")}) σ` : "";
  row("score", o => o.score?.toFixed(2));
  row("semi-axes (m)", o => lengths(o.estimate));
  row("true half extents (m)", o => lengths(o.truth));
  row("position error (m)", o => o.error?.[0].toFixed(4));
  row("shape, quality", o => o.error && `${o.error[1].toFixed(3)}, ${o.error[2].toFixed(3)}`);
  row("boxes", o => o.boxes && `${o.boxes}${o.box_rms == null ? "" : `, residual ${o.box_rms.toFixed(2)} σ (RMS)`}`);
  row("rules and factors", o => o.factors.map(f => `${f.factor}${f.with.map(k => ` with ${k}`).join("")}: ${f.because}${residual(f)}`).join("; ") || undefined);
  row("not applied", o => o.left_out.join("; ") || undefined);
  row("not mapped because", o => o.rejected);
  row("box in this frame (px)", o => {
    const variant = variants[found.indexOf(o)], seen = variant.frames[frame]?.[6].find(box => box[0] === id);
    if (!seen) return undefined;
    const [, measured, e] = seen;
    const projected = e && [e[0] - Math.sqrt(e[2]), e[1] - Math.sqrt(e[4]), e[0] + Math.sqrt(e[2]), e[1] + Math.sqrt(e[4])];
    return `measured ${measured.map(x => x.toFixed(0)).join(" ")}${projected ? `, estimated ${projected.map(x => x.toFixed(0)).join(" ")}` : ""}`;
  });
  // a live map has the boxes of the newest frame only
  const frames = variants.map(v => v.frames.every(f => f[6]) ? v.frames.flatMap((f, i) => f[6].some(box => box[0] === id) ? [i] : []) : []);
  row("detected in frames", o => {
    const of = frames[found.indexOf(o)];
    return of.length ? `${of.length}, from ${of[0]} to ${of[of.length - 1]}` : undefined;
  });
  table.append(body);
  const wide = element("div", "", { class: "wide" });
  wide.append(table);
  panel.append(heading, wide);
}
