'use strict';
// An orbit view of a point cloud in WebGL 1. The view's units: the cloud's cube is [-1, 1] along each axis.
function startCloudView(canvas, cloud) {
  const gl = canvas.getContext('webgl', { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;

  const decode = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const add = (a, b, s = 1) => a.map((v, i) => v + s * b[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((v) => v / (Math.hypot(...a) || 1));
  const average = (list) => list.reduce((sum, v) => add(sum, v, 1 / list.length), [0, 0, 0]);

  function compile(type, source) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    return shader;
  }

  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, `
    attribute vec3 position; attribute vec3 color; uniform mat4 clip; uniform float size; varying vec3 shade;
    void main() {
      gl_Position = clip * vec4(position, 1.0);
      gl_PointSize = max(1.0, size * 2.0 / max(gl_Position.w, 0.35));
      shade = color;
    }`));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER,
    'precision mediump float; varying vec3 shade; void main() { gl_FragColor = vec4(shade, 1.0); }'));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  gl.useProgram(program);

  function attribute(name, bytes, type) {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
    const place = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, type, true, 0, 0);
  }
  attribute('position', decode(cloud.positions), gl.SHORT);
  attribute('color', decode(cloud.colors), gl.UNSIGNED_BYTE);
  const clipPlace = gl.getUniformLocation(program, 'clip'), sizePlace = gl.getUniformLocation(program, 'size');
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(0.063, 0.071, 0.078, 1);

  // "Up" is what the cameras agree on; the first view is the middle camera's, a step back.
  const up = cloud.cameras.length ? unit(average(cloud.cameras.map((c) => c.up))) : [0, 0, 1];
  const east = unit(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up)), north = cross(up, east);
  const camera = cloud.cameras.length ? cloud.cameras[Math.floor(cloud.cameras.length / 2)]
    : { center: cloud.center.map((v, i) => v + 2 * cloud.scale * east[i]), forward: east.map((v) => -v) };
  const eye = camera.center.map((v, i) => (v - cloud.center[i]) / cloud.scale);
  // Turn about the place on the line of sight that is nearest to the cloud's middle.
  const ahead = Math.max(0.4, -dot(eye, camera.forward));
  const start = {
    azimuth: Math.atan2(-dot(camera.forward, north), -dot(camera.forward, east)),
    elevation: Math.asin(Math.max(-1, Math.min(1, -dot(camera.forward, up)))),
    distance: 1.15 * ahead, target: add(eye, camera.forward, ahead),
  };
  let view, pointSize = 2, pending = false;

  function axes() {
    const flat = add(east.map((v) => v * Math.cos(view.azimuth)), north, Math.sin(view.azimuth));
    const back = add(flat.map((v) => v * Math.cos(view.elevation)), up, Math.sin(view.elevation));
    const right = unit(cross(up, back));
    return { back, right, top: cross(back, right) };
  }

  function draw() {
    pending = false;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    const { back, right, top } = axes(), eyePoint = add(view.target, back, view.distance);
    const focal = 1.6, aspect = width / Math.max(1, height), near = 0.01, far = 30;
    const fx = focal / Math.max(1, aspect), fy = fx * aspect;
    const rows = [[right, fx], [top, fy]].map(([axis, f]) => [...axis.map((v) => v * f), -f * dot(axis, eyePoint)]);
    const depth = [...back.map((v) => -v), dot(back, eyePoint)];  // distance in front of the eye
    const a = (far + near) / (far - near), b = -2 * far * near / (far - near);
    const z = depth.map((v, i) => a * v + (i === 3 ? b : 0));
    const matrix = [];
    for (let column = 0; column < 4; ++column) matrix.push(rows[0][column], rows[1][column], z[column], depth[column]);
    gl.uniformMatrix4fv(clipPlace, false, matrix);
    gl.uniform1f(sizePlace, pointSize * ratio);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawArrays(gl.POINTS, 0, cloud.num_shown);
  }
  const redraw = () => { if (!pending) { pending = true; requestAnimationFrame(draw); } };

  const pointers = new Map();
  const zoom = (factor) => { view.distance = Math.min(8, Math.max(0.03, view.distance / factor)); redraw(); };
  function pan(dx, dy) {
    const { right, top } = axes(), step = view.distance * 1.3 / canvas.clientHeight;
    view.target = add(add(view.target, right, -dx * step), top, dy * step);
    redraw();
  }
  function turn(dx, dy) {
    view.azimuth -= dx * 0.006;
    view.elevation = Math.max(-1.5, Math.min(1.5, view.elevation + dy * 0.006));
    redraw();
  }
  canvas.addEventListener('wheel', (e) => { e.preventDefault(); zoom(Math.exp(-e.deltaY / 600)); }, { passive: false });
  canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  canvas.addEventListener('pointerdown', (e) => {
    canvas.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
  });
  canvas.addEventListener('pointermove', (e) => {
    const before = pointers.get(e.pointerId);
    if (!before) return;
    const dx = e.clientX - before.x, dy = e.clientY - before.y;
    const other = [...pointers.entries()].find(([id]) => id !== e.pointerId);
    if (other) {
      const gap = (p) => Math.hypot(p.x - other[1].x, p.y - other[1].y);
      zoom(gap({ x: e.clientX, y: e.clientY }) / Math.max(1, gap(before)));
      pan(dx / 2, dy / 2);
    } else if (e.buttons & 2 || e.shiftKey) {
      pan(dx, dy);
    } else {
      turn(dx, dy);
    }
    pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (e) => pointers.delete(e.pointerId));
  canvas.addEventListener('keydown', (e) => {
    const turns = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] };
    if (turns[e.key]) { e.preventDefault(); turn(...turns[e.key]); }
    if (e.key === '+') zoom(1.15);
    if (e.key === '-') zoom(1 / 1.15);
  });
  window.addEventListener('resize', redraw);

  function reset() {
    view = { ...start, target: [...start.target] };
    redraw();
  }
  reset();
  draw();
  return { reset, setPointSize(size) { pointSize = size; redraw(); } };
}
