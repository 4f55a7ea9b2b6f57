// The shapes of a variant, as lists of numbers for the renderer.

// The triangles of a sphere of radius 1.
function sphere(rings = 20, sectors = 32) {
  const points = [], triangles = [];
  for (let i = 0; i <= rings; i++)
    for (let j = 0; j <= sectors; j++) {
      const polar = Math.PI * i / rings, around = 2 * Math.PI * j / sectors;
      points.push(Math.sin(polar) * Math.cos(around), Math.sin(polar) * Math.sin(around), Math.cos(polar));
    }
  for (let i = 0; i < rings; i++)
    for (let j = 0; j < sectors; j++) {
      const a = i * (sectors + 1) + j, b = a + sectors + 1;
      triangles.push(a, b, a + 1, a + 1, b, b + 1);
    }
  return { points, triangles };
}

// Segments, 15 numbers each: two ends, two colours, length along the line so far, width in pixels, whether dashed.
class Segments {
  constructor() {
    this.numbers = [];
  }
  add(a, b, color, width, { to = color, along = 0, dashed = false } = {}) {
    this.numbers.push(...a.slice(0, 3), ...b.slice(0, 3), ...color, ...to, along, width, dashed ? 1 : 0);
  }
  // A path through the known points. A gap of more than five usual steps has no line.
  path(points, width, color, dashed = false) {
    const known = [...points.keys()].filter(i => points[i]), steps = known.slice(1).map((k, i) => k - known[i]);
    const gap = 5 * (steps.toSorted((a, b) => a - b)[steps.length >> 1] ?? 1);
    let along = 0;
    for (let k = 1; k < known.length; k++) {
      if (steps[k - 1] > gap) continue;
      const [i, j] = [known[k - 1], known[k]], [a, b] = [points[i], points[j]];
      this.add(a, b, color(i), width, { to: color(j), along, dashed });
      along += norm(sub(b, a));
    }
  }
  // A camera: its centre, and the corners of its image at a depth.
  frustum(pose, [fx, fy, cx, cy, width, height], depth, color, thick) {
    const corners = [[0, 0], [width, 0], [width, height], [0, height]]
      .map(([u, v]) => act(pose, [(u - cx) / fx * depth, (v - cy) / fy * depth, depth]));
    corners.forEach((corner, i) => {
      this.add(pose, corner, color, thick);
      this.add(corner, corners[(i + 1) % 4], color, thick);
    });
  }
  // The three principal ellipses of an ellipsoid.
  rings(shape, color, thick, corners = 40) {
    const parts = axes(shape);
    for (let i = 0; i < 3; i++) {
      const [a, b] = [parts[i], parts[(i + 1) % 3]];
      const at = k => {
        const angle = 2 * Math.PI * k / corners;
        return add(shape, add(scaled(a, Math.cos(angle)), scaled(b, Math.sin(angle))));
      };
      for (let k = 0; k < corners; k++) this.add(at(k), at(k + 1), color, thick);
    }
  }
  // The edges of a cuboid.
  cuboid(shape, color, thick) {
    const corner = bits => act(shape, [0, 1, 2].map(i => (bits >> i & 1 ? 1 : -1) * shape[7 + i]));
    for (let bits = 0; bits < 8; bits++)
      for (let i = 0; i < 3; i++)
        if (!(bits >> i & 1)) this.add(corner(bits), corner(bits | 1 << i), color, thick, { dashed: false });
  }
}

// Two directions at right angles to up and to each other.
function level(up) {
  const right = unit(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
  return [right, cross(up, right)];
}

// The middle and the radius of the map, and the height of its lowest object along up.
function extent(variants) {
  const shapes = variants.flatMap(v => v.objects).flatMap(o => [o.truth, o.estimate]).filter(Boolean);
  const cameras = variants.flatMap(v => v.frames).map(f => f[4]);
  const all = [...cameras, ...shapes].filter(p => p.slice(0, 3).every(Number.isFinite));
  // single far objects do not count
  const middle = [0, 1, 2].map(i => {
    const sorted = all.map(p => p[i]).sort((a, b) => a - b);
    return sorted.length ? (sorted[Math.floor(sorted.length * 0.02)] + sorted[Math.floor((sorted.length - 1) * 0.98)]) / 2 : 0;
  });
  const distances = all.map(p => norm(sub(p, middle))).sort((a, b) => a - b);
  const radius = Math.max(distances[Math.floor((distances.length - 1) * 0.98)] || 1, 1e-3);
  const up = variants[0].up, near = shapes.filter(s => norm(sub(s, middle)) <= 1.5 * radius);
  const low = near.map(s => dot(s, up) - Math.hypot(...axes(s).map(a => dot(a, up)))).sort((a, b) => a - b);
  return { middle, radius, floor: low.length ? low[Math.floor(low.length * 0.1)] : dot(middle, up) - radius };
}

// The sphere around the estimated objects without single far ones; null without an object.
function objectsExtent(variants) {
  const shapes = variants.flatMap(v => v.objects).map(o => o.estimate).filter(Boolean);
  if (!shapes.length) return null;
  const median = list => list.sort((a, b) => a - b)[list.length >> 1];
  const middle = [0, 1, 2].map(i => median(shapes.map(s => s[i])));
  const reach = shapes.map(s => norm(sub(s, middle)) + Math.max(...s.slice(7))).sort((a, b) => a - b);
  return { middle, radius: Math.max(reach[Math.floor((reach.length - 1) * 0.95)], 1e-3) };
}

// A grid on the floor, with round spacing, and an arrow along gravity.
function ground(segments, up, { middle, radius, floor }, color) {
  const [right, ahead] = level(up);
  const rough = radius / 5, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= rough);
  const at = (a, b) => add(add(scaled(right, a), scaled(ahead, b)), scaled(up, floor));
  const [a0, b0] = [right, ahead].map(d => Math.round(dot(middle, d) / step) * step), n = Math.ceil(1.3 * radius / step);
  for (let k = -n; k <= n; k++) {
    segments.add(at(a0 + k * step, b0 - n * step), at(a0 + k * step, b0 + n * step), color, 1);
    segments.add(at(a0 - n * step, b0 + k * step), at(a0 + n * step, b0 + k * step), color, 1);
  }
  const top = add(at(dot(middle, right) - 0.3 * radius, dot(middle, ahead) + 0.9 * radius), scaled(up, 0.45 * radius));
  const tip = add(top, scaled(up, -0.35 * radius));
  const gravity = rgb("#d6455d");
  segments.add(top, tip, gravity, 3);
  for (const side of [right, scaled(right, -1), ahead, scaled(ahead, -1)])
    segments.add(tip, add(tip, add(scaled(up, 0.08 * radius), scaled(side, 0.04 * radius))), gravity, 3);
  return { step, gravity: top };
}
