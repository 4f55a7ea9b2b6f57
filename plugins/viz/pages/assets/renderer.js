// WebGL 2: ellipsoids and lines, each kind in one call.
const ELLIPSOID = [`#version 300 es
in vec3 point; in vec3 a; in vec3 b; in vec3 c; in vec3 centre; in vec4 color;
uniform mat4 camera; uniform vec3 eye;
out vec3 normal; out vec3 toEye; out vec4 tint;
void main() {
  mat3 axes = mat3(a, b, c);
  vec3 at = centre + axes * point;
  normal = transpose(inverse(axes)) * point;
  toEye = eye - at;
  tint = color;
  gl_Position = camera * vec4(at, 1.0);
}`, `#version 300 es
precision highp float;
in vec3 normal; in vec3 toEye; in vec4 tint;
uniform vec3 above;
out vec4 result;
void main() {
  vec3 n = normalize(normal), e = normalize(toEye);
  // light from above, and a little from the eye
  float lit = 0.62 + 0.28 * dot(n, above) + 0.22 * abs(dot(n, e));
  float rim = pow(1.0 - abs(dot(n, e)), 3.0);
  vec3 shaded = tint.rgb * lit + 0.1 * pow(max(dot(n, normalize(e + above)), 0.0), 24.0);
  // a selected object has a bright rim
  result = vec4(mix(shaded, vec3(1.0), tint.a > 0.5 ? 0.25 + 0.75 * rim : 0.0), 1.0);
}`];

const LINE = [`#version 300 es
in vec2 corner; in vec3 from; in vec3 to; in vec3 colorFrom; in vec3 colorTo; in vec3 look;
uniform mat4 camera; uniform vec2 size;
out vec3 tint; out float along; flat out float dashed;
void main() {
  vec4 p = camera * vec4(from, 1.0), q = camera * vec4(to, 1.0);
  float near = 1e-4;
  // the part behind the eye is cut off
  vec4 p0 = p.w < near ? mix(p, q, (near - p.w) / (q.w - p.w)) : p;
  vec4 q0 = q.w < near ? mix(q, p, (near - q.w) / (p.w - q.w)) : q;
  vec4 at = corner.x < 0.5 ? p0 : q0;
  vec2 way = (q0.xy / q0.w - p0.xy / p0.w) * size;
  vec2 side = length(way) > 0.0 ? normalize(vec2(-way.y, way.x)) : vec2(0.0, 1.0);
  at.xy += side * corner.y * look.y / size * at.w;
  tint = corner.x < 0.5 ? colorFrom : colorTo;
  along = look.x + corner.x * distance(from, to);
  dashed = look.z;
  gl_Position = p.w < near && q.w < near ? vec4(2.0, 2.0, 2.0, 1.0) : at;
}`, `#version 300 es
precision highp float;
in vec3 tint; in float along; flat in float dashed;
uniform float dash;
out vec4 result;
void main() {
  if (dashed > 0.5 && fract(along / dash) > 0.6) discard;
  result = vec4(tint, 1.0);
}`];

class Renderer {
  // Throws without WebGL 2.
  constructor(canvas) {
    this.canvas = canvas;
    const gl = this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL 2");
    const { points, triangles } = sphere();
    this.corners = triangles.length;
    this.ellipsoids = this.kind(ELLIPSOID, "point", 3, points, ["a", 3, "b", 3, "c", 3, "centre", 3, "color", 4]);
    this.lines = this.kind(LINE, "corner", 2, [0, -1, 0, 1, 1, -1, 1, 1],
      ["from", 3, "to", 3, "colorFrom", 3, "colorTo", 3, "look", 3]);
    gl.bindVertexArray(this.ellipsoids.array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(triangles), gl.STATIC_DRAW);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
  }

  // A program, the mesh of one instance, and the attributes of each instance.
  kind([vertex, fragment], own, width, mesh, fields) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const field = (name, size, stride, offset, divisor) => {
      const place = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset);
      gl.vertexAttribDivisor(place, divisor);
    };
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(mesh), gl.STATIC_DRAW);
    field(own, width, 0, 0, 0);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    const sizes = fields.filter((_, i) => i % 2), stride = sizes.reduce((a, b) => a + b, 0);
    let offset = 0;
    for (let i = 0; i < fields.length; i += 2) {
      field(fields[i], fields[i + 1], 4 * stride, 4 * offset, 1);
      offset += fields[i + 1];
    }
    return { program, array, buffer, stride, uniform: name => gl.getUniformLocation(program, name) };
  }

  fill(kind, numbers) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, kind.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.DYNAMIC_DRAW);
    return numbers.length / kind.stride;
  }

  // Gives the canvas one pixel for each pixel of the screen.
  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    this.ratio = ratio;
  }

  // Draws a part of the canvas: a rectangle in its own pixels, from below.
  draw([x, y, width, height], { camera, eye, above, paper, dash }, ellipsoids, segments) {
    const gl = this.gl;
    gl.viewport(x, y, width, height);
    gl.scissor(x, y, width, height);
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.ellipsoids.program);
    gl.bindVertexArray(this.ellipsoids.array);
    gl.uniformMatrix4fv(this.ellipsoids.uniform("camera"), false, camera);
    gl.uniform3fv(this.ellipsoids.uniform("eye"), eye);
    gl.uniform3fv(this.ellipsoids.uniform("above"), above);
    let count = this.fill(this.ellipsoids, ellipsoids);
    if (count) gl.drawElementsInstanced(gl.TRIANGLES, this.corners, gl.UNSIGNED_SHORT, 0, count);
    gl.useProgram(this.lines.program);
    gl.bindVertexArray(this.lines.array);
    gl.uniformMatrix4fv(this.lines.uniform("camera"), false, camera);
    gl.uniform2f(this.lines.uniform("size"), width / this.ratio, height / this.ratio);
    gl.uniform1f(this.lines.uniform("dash"), dash);
    count = this.fill(this.lines, segments);
    if (count) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
  }
}
