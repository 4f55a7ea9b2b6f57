"use strict";
// Vectors are arrays of 3, matrices of 16 by columns, poses [x, y, z, qx, qy, qz, qw], shapes a pose and 3 half extents.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = a => Math.sqrt(dot(a, a));
const unit = a => scaled(a, 1 / (norm(a) || 1));

// The columns of the rotation of a pose.
function columns(pose) {
  const [, , , x, y, z, w] = pose;
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
  ];
}

// The semi-axes of a shape, lengthened to a visible minimum.
function axes(shape) {
  return columns(shape).map((column, i) => scaled(column, Math.max(shape[7 + i], 1e-4)));
}

// Transforms a point from the frame of a pose to the outer frame.
function act(pose, p) {
  const [a, b, c] = columns(pose);
  return [0, 1, 2].map(i => pose[i] + a[i] * p[0] + b[i] * p[1] + c[i] * p[2]);
}

function product(a, b) {
  const out = new Array(16).fill(0);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return out;
}

function perspective(fovy, aspect, near, far) {
  const f = 1 / Math.tan(fovy / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
}

function lookAt(eye, target, up) {
  const z = unit(sub(eye, target)), x = unit(cross(up, z)), y = cross(z, x);
  return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
}

// The first intersection of a ray with an ellipsoid, as a multiple of the direction; Infinity without one.
function meets(shape, origin, direction) {
  const parts = columns(shape), away = sub(origin, shape);
  const into = v => parts.map((column, i) => dot(column, v) / Math.max(shape[7 + i], 1e-4));
  const o = into(away), d = into(direction);
  const a = dot(d, d), b = dot(o, d), c = dot(o, o) - 1, root = b * b - a * c;
  return root < 0 || b > 0 ? Infinity : (-b - Math.sqrt(root)) / a;
}

function rgb(hex) {
  return [1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16) / 255);
}

// From blue by green and yellow to red, over 0 to 1.
function ramp(share) {
  const stops = ["#2c5fb8", "#27a69a", "#b7c832", "#f0b429", "#d7373f"].map(rgb);
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1), i = Math.min(Math.floor(at), stops.length - 2);
  return stops[i].map((v, k) => v + (stops[i + 1][k] - v) * (at - i));
}
