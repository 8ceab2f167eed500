'use strict';
const report = JSON.parse(document.getElementById('data').textContent);
const byId = (id) => document.getElementById(id);

function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  return element;
}

const percent = (value) => (value < 0 ? '–' : value.toFixed(1) + ' %');
const mean = (values) => values.reduce((a, b) => a + b, 0) / Math.max(1, values.length);
const known = (values) => values.filter((v) => v >= 0);
// What other images confirmed; maps of other programs have no such file, their final map is all measured.
const measuredOf = (image) => (image.measured >= 0 ? image.measured
  : image.geometric >= 0 ? image.geometric - Math.max(0, image.filled) : image.photometric);

function duration(seconds) {
  if (seconds < 60) return seconds.toFixed(1) + ' s';
  if (seconds < 3600) return (seconds / 60).toFixed(1) + ' min';
  return (seconds / 3600).toFixed(1) + ' h';
}

const gigabytes = (bytes) => (bytes / 1e9).toFixed(2) + ' GB';

function fillTable(table, rows) {
  rows.forEach((cells, r) => {
    const row = make('tr');
    for (const cell of cells) row.append(make(r === 0 ? 'th' : 'td', '', cell));
    table.append(row);
  });
}

function showSummary() {
  byId('origin').textContent =
    `${report.workspace} · written ${report.written} by phimvs ${report.program}`;
  const stages = Object.values(report.stages || {});
  const tiles = [[report.images.length, 'images']];
  if (report.cloud) tiles.push([report.cloud.num_points.toLocaleString('en'), 'points in the cloud']);
  const measured = known(report.images.map(measuredOf));
  const geometric = known(report.images.map((i) => i.geometric));
  if (measured.length) tiles.push([percent(mean(measured)), 'of pixels measured']);
  if (geometric.length) tiles.push([percent(mean(geometric)), 'of pixels after filling']);
  for (const e of report.evaluations.slice(0, 1)) {
    const t = Math.min(1, e.tolerances.length - 1);
    tiles.push([e.f1[t].toFixed(1), `F1 at ${e.tolerances[t]}`]);
  }
  const runs = report.runs || [];
  if (runs.length) {
    tiles.push([duration(runs.reduce((a, r) => a + r.seconds, 0)), runs.length > 1 ? `of stereo in ${runs.length} runs` : 'of stereo']);
    tiles.push([gigabytes(Math.max(...runs.map((r) => r.peak_memory_bytes))), 'most memory']);
    const device = Math.max(...runs.flatMap((r) => r.devices.map((d) => d.peak_memory_bytes)));
    if (device > 0) tiles.push([gigabytes(device), 'most GPU memory']);
  } else if (stages.length) {  // an interrupted run tells of its tasks only
    tiles.push([duration(stages.reduce((a, s) => a + s.seconds, 0)), 'of stereo tasks']);
    tiles.push([gigabytes(Math.max(...stages.map((s) => s.peak_memory_bytes))), 'most memory']);
  }
  for (const [value, label] of tiles) {
    const tile = make('div', 'tile');
    tile.append(make('b', '', value), make('span', '', label));
    byId('summary').append(tile);
  }
}

function showWarnings() {
  byId('warnings').hidden = report.warnings.length === 0;
  for (const warning of report.warnings) byId('warnings').querySelector('ul').append(make('li', '', warning));
}

function showCoverage() {
  for (const image of report.images) {
    const measured = Math.max(0, measuredOf(image));
    const total = image.geometric >= 0 ? image.geometric : measured;
    // Filtering again after filling may drop measured pixels: the final map is what the bar shows.
    const filled = Math.max(0, image.filled);
    const bar = make('div', 'bar');
    for (const [name, share] of [['measured', total - filled], ['filled', filled]]) {
      const part = make('div', name);
      part.style.width = share + '%';
      bar.append(part);
    }
    const row = make('div', 'bar-row');
    const name = make('span', 'name', image.name);
    name.title = image.name;
    row.append(name, bar, make('span', 'figure', `${percent(measured)} → ${percent(total)}`));
    byId('coverage-bars').append(row);
  }
}

const colours = ['#2a78b8', '#e07b2a', '#3f9a57', '#b24a8c', '#8a6d3b', '#6a5acd'];

function curve(title, key) {
  const width = 360, height = 250, left = 38, right = 14, top = 34, bottom = 34;
  const all = report.evaluations.flatMap((e) => e.tolerances);
  const lower = Math.log(Math.min(...all)), upper = Math.log(Math.max(...all));
  const x = (t) => left + (upper > lower ? (Math.log(t) - lower) / (upper - lower) : 0.5) * (width - left - right);
  const y = (v) => top + (1 - v / 100) * (height - top - bottom);
  let svg = `<text class="title" x="${left}" y="20">${title}, %</text>`;
  for (const v of [0, 25, 50, 75, 100]) {
    svg += `<line class="grid" x1="${left}" x2="${width - right}" y1="${y(v)}" y2="${y(v)}"/>` +
      `<text x="${left - 6}" y="${y(v) + 4}" text-anchor="end">${v}</text>`;
  }
  for (const t of new Set(all)) svg += `<text x="${x(t)}" y="${height - 14}" text-anchor="middle">${t}</text>`;
  report.evaluations.forEach((e, i) => {
    const points = e.tolerances.map((t, k) => [x(t), y(e[key][k])]);
    svg += `<polyline fill="none" stroke="${colours[i % colours.length]}" stroke-width="2" points="${points.join(' ')}"/>`;
    points.forEach(([px, py], k) => {
      svg += `<circle cx="${px}" cy="${py}" r="3.5" fill="${colours[i % colours.length]}">` +
        `<title>${e[key][k].toFixed(2)} % at ${e.tolerances[k]}</title></circle>`;
    });
  });
  const element = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  element.setAttribute('viewBox', `0 0 ${width} ${height}`);
  element.setAttribute('role', 'img');
  element.setAttribute('aria-label', `${title} over tolerance`);
  element.innerHTML = svg;
  return element;
}

function showScores() {
  if (!report.evaluations.length) return;
  byId('scores').hidden = false;
  byId('curves').append(curve('F1', 'f1'), curve('Accuracy', 'accuracy'), curve('Completeness', 'completeness'));
  const rows = [['cloud', 'tolerance', 'accuracy %', 'completeness %', 'F1 %']];
  for (const e of report.evaluations) {
    e.tolerances.forEach((t, k) => rows.push([e.name, t, ...[e.accuracy, e.completeness, e.f1].map((v) => v[k].toFixed(2))]));
  }
  fillTable(byId('score-table'), rows);
  // The first column names the curve's colour.
  byId('score-table').querySelectorAll('tr').forEach((row) => {
    const i = report.evaluations.findIndex((e) => e.name === row.firstChild.textContent);
    if (i < 0) return;
    const key = make('span', 'key');
    key.style.background = colours[i % colours.length];
    row.firstChild.prepend(key, ' ');
  });
}

// Wall time by stage of every run that ended, and what the last one used.
function showRuns(runs) {
  if (!runs.length) return;
  const rows = [['stage', 'images', 'seconds', 'seconds/image', 'ZNCC samples/s', 'run that ended']];
  const row = (run, name, images, seconds, samples) => rows.push([name, images, seconds.toFixed(2),
    (seconds / Math.max(1, images)).toFixed(3), samples ? samples.toExponential(2) : '', run]);
  for (const r of runs) {
    for (const s of r.stages) row(r.finished, s.stage, s.images, s.seconds);
    for (const d of r.devices) {
      for (const s of d.stages) row(r.finished, `${s.stage}, device time of ${d.name}`, s.images, s.seconds, s.samples_per_second);
    }
    row(r.finished, 'all', r.images - r.images_kept, r.seconds);
  }
  fillTable(byId('run-table'), rows);
  const last = runs[runs.length - 1];
  const parts = [`${last.images_per_second.toFixed(3)} images/s`, `${gigabytes(last.peak_memory_bytes)} of memory at most`,
    ...last.devices.filter((d) => d.peak_memory_bytes > 0).map((d) => `${gigabytes(d.peak_memory_bytes)} on ${d.name}`),
    `${gigabytes(last.bytes_written)} of maps written at ${(last.bytes_per_second_and_writer / 1e6).toFixed(0)} MB/s a writer`];
  byId('run-figures').textContent = `Last run: ${parts.join(', ')}. Stages: wall time.`;
}

function showTimes() {
  const stages = Object.entries(report.stages || {});
  if (!stages.length) return;
  byId('times').hidden = false;
  showRuns(report.runs || []);
  const rows = [['stage', 'images', 'failed', 'seconds', 'seconds/image', 'peak memory MB']];
  for (const [name, s] of stages) {
    rows.push([name, s.done, s.failed, s.seconds.toFixed(2), (s.seconds / Math.max(1, s.done)).toFixed(3),
      (s.peak_memory_bytes / 1e6).toFixed(0)]);
  }
  fillTable(byId('task-table'), rows);
}

function showSettings() {
  const options = Object.entries(report.options || {});
  if (!options.length) return;
  byId('settings').hidden = false;
  fillTable(byId('settings').querySelector('table'), [['option', 'value'], ...options.map(([k, v]) => [k, String(v)])]);
}

// Full-window view of one picture: wheel or pinch zooms at the pointer, dragging moves, layers keep the place.
const viewer = {
  image: null, layer: 0, scale: 1, x: 0, y: 0, pointers: new Map(),

  open(image, layer) {
    this.image = image;
    byId('viewer').hidden = false;
    byId('viewer-title').textContent = image.name;
    const layers = byId('viewer-layers');
    layers.replaceChildren();
    image.pictures.forEach((p, i) => {
      const button = make('button', '', p.title);
      button.onclick = () => this.show(i);
      layers.append(button);
    });
    const picture = byId('viewer-picture');
    picture.onload = () => { this.fit(); picture.onload = null; };
    this.show(layer);
    byId('viewer-close').focus();
  },
  close() { byId('viewer').hidden = true; },
  show(layer) {
    this.layer = (layer + this.image.pictures.length) % this.image.pictures.length;
    const p = this.image.pictures[this.layer];
    byId('viewer-picture').src = p.uri;
    byId('viewer-picture').alt = p.title;
    byId('viewer-caption').textContent = `${p.title}: ${p.caption}. Scroll or pinch to zoom, drag to move.`;
    [...byId('viewer-layers').children].forEach((b, i) => b.setAttribute('aria-pressed', i === this.layer));
  },
  fit() {
    const stage = byId('viewer-stage').getBoundingClientRect(), picture = byId('viewer-picture');
    this.scale = Math.min(stage.width / picture.naturalWidth, stage.height / picture.naturalHeight);
    this.x = (stage.width - this.scale * picture.naturalWidth) / 2;
    this.y = (stage.height - this.scale * picture.naturalHeight) / 2;
    this.place();
  },
  place() {
    byId('viewer-picture').style.transform = `translate(${this.x}px, ${this.y}px) scale(${this.scale})`;
  },
  zoom(factor, clientX, clientY) {
    const stage = byId('viewer-stage').getBoundingClientRect();
    const px = clientX - stage.left, py = clientY - stage.top;
    const next = Math.min(40, Math.max(0.05, this.scale * factor));
    this.x = px - (px - this.x) * next / this.scale;
    this.y = py - (py - this.y) * next / this.scale;
    this.scale = next;
    this.place();
  },
  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const others = [...this.pointers.entries()].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
    if (others.length) {
      const gap = (p) => Math.hypot(p.x - others[0].x, p.y - others[0].y);
      const now = { x: event.clientX, y: event.clientY };
      if (gap(before) > 0) this.zoom(gap(now) / gap(before), (now.x + others[0].x) / 2, (now.y + others[0].y) / 2);
    } else {
      this.x += event.clientX - before.x;
      this.y += event.clientY - before.y;
      this.place();
    }
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  },
  listen() {
    const stage = byId('viewer-stage');
    stage.addEventListener('wheel', (e) => {
      e.preventDefault();
      this.zoom(Math.exp(-e.deltaY / 400), e.clientX, e.clientY);
    }, { passive: false });
    stage.addEventListener('pointerdown', (e) => {
      stage.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    });
    stage.addEventListener('pointermove', (e) => this.move(e));
    for (const end of ['pointerup', 'pointercancel']) {
      stage.addEventListener(end, (e) => this.pointers.delete(e.pointerId));
    }
    stage.addEventListener('dblclick', () => this.fit());
    byId('viewer-close').onclick = () => this.close();
    document.addEventListener('keydown', (e) => {
      if (byId('viewer').hidden) return;
      if (e.key === 'Escape') this.close();
      if (e.key === 'ArrowRight') this.show(this.layer + 1);
      if (e.key === 'ArrowLeft') this.show(this.layer - 1);
    });
  },
};

function showImage(image) {
  const figures = [['raw', image.photometric], ['measured', image.measured], ['final', image.geometric],
    ['inferred', image.filled]].filter(([, v]) => v >= 0);
  byId('image-figures').textContent = 'Pixels with a depth: ' + figures.map(([k, v]) => `${k} ${percent(v)}`).join(', ');
  byId('pictures').replaceChildren(...image.pictures.map((p, i) => {
    const figure = make('figure'), button = make('button'), picture = make('img');
    picture.src = p.uri;
    picture.alt = `${p.title} of ${image.name}`;
    button.append(picture);
    button.title = 'Enlarge';
    button.onclick = () => viewer.open(image, i);
    const caption = make('figcaption', '', p.caption);
    caption.prepend(make('b', '', p.title));
    figure.append(button, caption);
    return figure;
  }));
}

function showImages() {
  const shown = report.images.filter((i) => i.pictures.length);
  byId('images').hidden = shown.length === 0;
  if (!shown.length) return;
  const choice = byId('image-choice');
  shown.forEach((image, i) => choice.append(new Option(`${image.name} (${i + 1} of ${shown.length})`, i)));
  const go = (i) => {
    choice.value = (i + shown.length) % shown.length;
    showImage(shown[choice.value]);
  };
  choice.onchange = () => go(+choice.value);
  byId('previous').onclick = () => go(+choice.value - 1);
  byId('next').onclick = () => go(+choice.value + 1);
  go(0);
}

function showCloud() {
  const cloud = report.cloud;
  if (!cloud || !cloud.num_shown) return;
  byId('cloud').hidden = false;
  const few = cloud.num_shown < cloud.num_points ? `${cloud.num_shown.toLocaleString('en')} of ` : '';
  byId('cloud-caption').textContent = `${few}${cloud.num_points.toLocaleString('en')} points of ${cloud.file}. ` +
    'Drag to turn, scroll or pinch to zoom, right-drag or two fingers to move.';
  const view = startCloudView(byId('cloud-canvas'), cloud);
  if (!view) {
    byId('cloud-caption').textContent += ' This browser has no WebGL, so the view stays empty.';
    return;
  }
  byId('cloud-reset').onclick = () => view.reset();
  byId('cloud-size').oninput = (e) => view.setPointSize(+e.target.value);
}

showSummary();
showWarnings();
showCoverage();
showScores();
showTimes();
showSettings();
showImages();
viewer.listen();
showCloud();
document.documentElement.dataset.ready = 'true';
