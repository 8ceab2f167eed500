'use strict';
// Vectors as arrays of three numbers.
const vec = {
  add: (a, b, s = 1) => a.map((v, i) => v + s * b[i]),
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  unit: (a) => a.map((v) => v / (Math.hypot(...a) || 1)),
  average: (list) => list.reduce((sum, v) => vec.add(sum, v, 1 / list.length), [0, 0, 0]),
};

const decodeBytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

// The corners of each camera's image plane and its centre, in the view's units.
function cameraFrusta(cloud) {
  const centers = cloud.cameras.map((c) => c.center.map((v, i) => (v - cloud.center[i]) / cloud.scale));
  const gaps = centers.map((a, i) => Math.min(...centers.filter((b, j) => j !== i).map((b) => Math.hypot(...vec.add(a, b, -1)))))
    .filter(isFinite).sort((a, b) => a - b);
  const size = Math.min(0.1, Math.max(0.008, 0.25 * (gaps[gaps.length >> 1] || 0.1)));
  return cloud.cameras.map((camera, i) => {
    const right = vec.unit(vec.cross(camera.forward, camera.up)), tan = Math.max(camera.tan_x, camera.tan_y);
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => {
      const ray = vec.add(vec.add(camera.forward, right, x * camera.tan_x), camera.up, y * camera.tan_y);
      return vec.add(centers[i], ray, size / Math.max(1, tan));
    });
    return { center: centers[i], corners };
  });
}

function frustumLines(frustum) {
  const { center, corners } = frustum;
  return corners.flatMap((corner, k) => [center, corner, corner, corners[(k + 1) % 4]]);
}

// From (x, y) to the segment between a and b.
function segmentDistance(a, b, x, y) {
  const dx = b[0] - a[0], dy = b[1] - a[1], length = dx * dx + dy * dy;
  const t = length > 0 ? Math.min(1, Math.max(0, ((x - a[0]) * dx + (y - a[1]) * dy) / length)) : 0;
  return Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
}

// Points and lines with WebGL 1.
class Painter {
  static create(canvas) {
    const gl = canvas.getContext('webgl', { antialias: true, preserveDrawingBuffer: true });
    if (!gl) return null;
    const painter = new Painter(gl);
    return painter.program ? painter : null;
  }

  constructor(gl) {
    this.gl = gl;
    const program = gl.createProgram();
    const attach = (type, source) => {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    };
    attach(gl.VERTEX_SHADER, `
      attribute vec3 position; attribute vec3 color; uniform mat4 clip; uniform float size; varying vec3 shade;
      void main() {
        gl_Position = clip * vec4(position, 1.0);
        gl_PointSize = max(1.0, size * 2.0 / max(gl_Position.w, 0.35));
        shade = color;
      }`);
    attach(gl.FRAGMENT_SHADER,
      'precision mediump float; varying vec3 shade; void main() { gl_FragColor = vec4(shade, 1.0); }');
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
    this.program = program;
    gl.useProgram(program);
    this.places = ['position', 'color'].map((name) => gl.getAttribLocation(program, name));
    this.places.forEach((place) => gl.enableVertexAttribArray(place));
    this.clip = gl.getUniformLocation(program, 'clip');
    this.size = gl.getUniformLocation(program, 'size');
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0.063, 0.071, 0.078, 1);
  }

  // positions: Int16Array (1 = 32767) or Float32Array; colors: Uint8Array.
  layer(mode, positions, colors) {
    const { gl } = this;
    const layer = { mode, count: positions.length / 3, type: positions instanceof Int16Array ? gl.SHORT : gl.FLOAT,
      buffers: [gl.createBuffer(), gl.createBuffer()] };
    this.fill(layer.buffers[0], positions);
    this.fill(layer.buffers[1], colors);
    return layer;
  }
  fill(buffer, data) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, data, this.gl.STATIC_DRAW);
  }
  draw(layer, size) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, layer.buffers[0]);
    gl.vertexAttribPointer(this.places[0], 3, layer.type, layer.type === gl.SHORT, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, layer.buffers[1]);
    gl.vertexAttribPointer(this.places[1], 3, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.uniform1f(this.size, size);
    gl.drawArrays(layer.mode, 0, layer.count);
  }
}

// Where the eye is: it turns about a target. The view's units: the cloud's cube is [-1, 1] along each axis.
class Orbit {
  constructor(cloud) {
    this.up = cloud.cameras.length ? vec.unit(vec.average(cloud.cameras.map((c) => c.up))) : [0, 0, 1];
    this.east = vec.unit(vec.cross(Math.abs(this.up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], this.up));
    this.north = vec.cross(this.up, this.east);
    this.cloud = cloud;
    this.reset();
  }
  reset() {
    const { cloud } = this;
    this.lookFrom(cloud.cameras.length ? cloud.cameras[Math.floor(cloud.cameras.length / 2)]
      : { center: cloud.center.map((v, i) => v + 2 * cloud.scale * this.east[i]), forward: this.east.map((v) => -v) });
  }
  // Turns about the place on the line of sight that is nearest to the cloud's middle.
  lookFrom(camera) {
    const eye = camera.center.map((v, i) => (v - this.cloud.center[i]) / this.cloud.scale);
    const ahead = Math.max(0.4, -vec.dot(eye, camera.forward));
    this.azimuth = Math.atan2(-vec.dot(camera.forward, this.north), -vec.dot(camera.forward, this.east));
    this.elevation = Math.asin(Math.max(-1, Math.min(1, -vec.dot(camera.forward, this.up))));
    this.distance = 1.15 * ahead;
    this.target = vec.add(eye, camera.forward, ahead);
  }
  axes() {
    const flat = vec.add(this.east.map((v) => v * Math.cos(this.azimuth)), this.north, Math.sin(this.azimuth));
    const back = vec.add(flat.map((v) => v * Math.cos(this.elevation)), this.up, Math.sin(this.elevation));
    const right = vec.unit(vec.cross(this.up, back));
    return { back, right, top: vec.cross(back, right) };
  }
  // To clip space, column by column.
  matrix(aspect) {
    const { back, right, top } = this.axes(), eye = vec.add(this.target, back, this.distance);
    const focal = 1.6, near = 0.01, far = 30, fx = focal / Math.max(1, aspect), fy = fx * aspect;
    const rows = [[right, fx], [top, fy]].map(([axis, f]) => [...axis.map((v) => v * f), -f * vec.dot(axis, eye)]);
    const depth = [...back.map((v) => -v), vec.dot(back, eye)];  // distance in front of the eye
    const a = (far + near) / (far - near), b = -2 * far * near / (far - near);
    const z = depth.map((v, i) => a * v + (i === 3 ? b : 0));
    return [0, 1, 2, 3].flatMap((column) => [rows[0][column], rows[1][column], z[column], depth[column]]);
  }
  zoom(factor) { this.distance = Math.min(8, Math.max(0.03, this.distance / factor)); }
  pan(dx, dy, height) {
    const { right, top } = this.axes(), step = this.distance * 1.3 / height;
    this.target = vec.add(vec.add(this.target, right, -dx * step), top, dy * step);
  }
  turn(dx, dy) {
    this.azimuth -= dx * 0.006;
    this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + dy * 0.006));
  }
}

// Drag, wheel, pinch and keys; `onClick` gets a place on the canvas.
function listenToCanvas(canvas, orbit, redraw, onClick) {
  const pointers = new Map();
  let moved = 0;
  const act = (action) => { action(); redraw(); };
  canvas.addEventListener('wheel', (e) => {
    e.preventDefault();
    act(() => orbit.zoom(Math.exp(-e.deltaY / 600)));
  }, { passive: false });
  canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  canvas.addEventListener('pointerdown', (e) => {
    capturePointer(canvas, e);
    if (pointers.size === 0) moved = 0;
    pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
  });
  canvas.addEventListener('pointermove', (e) => {
    const before = pointers.get(e.pointerId);
    if (!before) return;
    const dx = e.clientX - before.x, dy = e.clientY - before.y;
    moved += Math.abs(dx) + Math.abs(dy);
    const other = [...pointers.entries()].find(([id]) => id !== e.pointerId);
    if (other) {
      const gap = (p) => Math.hypot(p.x - other[1].x, p.y - other[1].y);
      orbit.zoom(gap({ x: e.clientX, y: e.clientY }) / Math.max(1, gap(before)));
      orbit.pan(dx / 2, dy / 2, canvas.clientHeight);
    } else if (e.buttons & 2 || e.shiftKey) {
      orbit.pan(dx, dy, canvas.clientHeight);
    } else {
      orbit.turn(dx, dy);
    }
    redraw();
    pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
  });
  canvas.addEventListener('pointercancel', (e) => pointers.delete(e.pointerId));
  canvas.addEventListener('pointerup', (e) => {
    pointers.delete(e.pointerId);
    const box = canvas.getBoundingClientRect();
    if (moved < 5 && e.button === 0) onClick(e.clientX - box.left, e.clientY - box.top);
  });
  canvas.addEventListener('keydown', (e) => {
    const turns = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] };
    if (turns[e.key]) { e.preventDefault(); act(() => orbit.turn(...turns[e.key])); }
    if (e.key === '+') act(() => orbit.zoom(1.15));
    if (e.key === '-') act(() => orbit.zoom(1 / 1.15));
    if (e.key === '0') act(() => orbit.reset());
  });
  window.addEventListener('resize', redraw);
}

// An orbit view of the cloud and its cameras. on.point(index or null) and on.camera(index) answer clicks. Null without
// WebGL.
function startCloudView(canvas, cloud, on) {
  const painter = Painter.create(canvas);
  if (!painter) return null;
  const { gl } = painter, orbit = new Orbit(cloud);
  const positions = new Int16Array(decodeBytes(cloud.positions).buffer);
  const points = painter.layer(gl.POINTS, positions, decodeBytes(cloud.colors));
  const frusta = cameraFrusta(cloud);
  const frustumLayer = painter.layer(gl.LINES, new Float32Array(frusta.flatMap(frustumLines).flat()),
    new Uint8Array(frusta.length * 16 * 3));
  let pointSize = 2, camerasShown = true, chosen = null, pending = false;

  const place = (i) => [0, 1, 2].map((axis) => positions[3 * i + axis] / 32767);
  const aspect = () => canvas.clientWidth / Math.max(1, canvas.clientHeight);

  function draw() {
    pending = false;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.uniformMatrix4fv(painter.clip, false, orbit.matrix(aspect()));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    painter.draw(points, pointSize * ratio);
    if (camerasShown) painter.draw(frustumLayer, 1);
    if (chosen) {
      gl.disable(gl.DEPTH_TEST);
      painter.draw(chosen.lines, 1);
      painter.draw(chosen.point, 7 * ratio);
      gl.enable(gl.DEPTH_TEST);
    }
  }
  const redraw = () => { if (!pending) { pending = true; requestAnimationFrame(draw); } };

  // On the canvas, with the distance from the eye; null behind it.
  function project(matrix, p) {
    const w = matrix[3] * p[0] + matrix[7] * p[1] + matrix[11] * p[2] + matrix[15];
    if (w < 0.01) return null;
    const x = (matrix[0] * p[0] + matrix[4] * p[1] + matrix[8] * p[2] + matrix[12]) / w;
    const y = (matrix[1] * p[0] + matrix[5] * p[1] + matrix[9] * p[2] + matrix[13]) / w;
    return [(x + 1) / 2 * canvas.clientWidth, (1 - y) / 2 * canvas.clientHeight, w];
  }

  // By its lines, so that points inside can be clicked too.
  function pickCamera(matrix, x, y) {
    const reach = 5;
    let best = -1, nearest = reach;
    frusta.forEach((frustum, i) => {
      const ends = frustumLines(frustum).map((p) => project(matrix, p));
      for (let k = 0; k < ends.length; k += 2) {
        if (!ends[k] || !ends[k + 1]) continue;
        const distance = segmentDistance(ends[k], ends[k + 1], x, y);
        if (distance < nearest) { best = i; nearest = distance; }
      }
    });
    return best;
  }

  function pickPoint(matrix, x, y) {
    const reach = 7;
    let best = -1, nearest = Infinity;
    for (let i = 0; i < points.count; ++i) {
      const p = project(matrix, place(i));
      if (!p || Math.abs(p[0] - x) > reach || Math.abs(p[1] - y) > reach) continue;
      if (p[2] < nearest) { best = i; nearest = p[2]; }
    }
    return best;
  }

  function click(x, y) {
    const matrix = orbit.matrix(aspect());
    const camera = camerasShown ? pickCamera(matrix, x, y) : -1;
    if (camera >= 0) return on.camera(camera);
    const point = pickPoint(matrix, x, y);
    return on.point(point >= 0 ? point : null);
  }
  listenToCanvas(canvas, orbit, redraw, click);

  const view = {
    reset() { orbit.reset(); redraw(); },
    lookFrom(camera) { orbit.lookFrom(cloud.cameras[camera]); redraw(); },
    setPointSize(size) { pointSize = size; redraw(); },
    setColors(colors) { painter.fill(points.buffers[1], colors); redraw(); },
    showCameras(shown) { camerasShown = shown; redraw(); },
    // Marks cameras, all others are dim.
    markCameras(marked) {
      const colors = new Uint8Array(frusta.length * 48);
      frusta.forEach((f, i) => {
        const color = marked.includes(i) ? [255, 214, 64] : [110, 170, 220];
        for (let v = 0; v < 16; ++v) colors.set(color, 48 * i + 3 * v);
      });
      painter.fill(frustumLayer.buffers[1], colors);
      redraw();
    },
    // A point with lines to the cameras that see it; null: none.
    choose(index, cameras) {
      chosen = index === null ? null : {
        point: painter.layer(gl.POINTS, new Float32Array(place(index)), new Uint8Array([255, 60, 60])),
        lines: painter.layer(gl.LINES, new Float32Array(cameras.flatMap((c) => [...place(index), ...frusta[c].center])),
          new Uint8Array(cameras.length * 6).map((v, i) => [255, 214, 64][i % 3])),
      };
      redraw();
    },
    // For tests by hand and links: where a point or a camera is on the canvas.
    placeOf(what, index) {
      return project(orbit.matrix(aspect()), what === 'camera' ? frusta[index].center : place(index));
    },
  };
  view.markCameras([]);
  draw();
  return view;
}
