'use strict';
function showSummary() {
  byId('origin').textContent =
    `${report.workspace} · written ${report.written} by phimvs ${report.program}`;
  const stages = Object.values(report.stages || {});
  const tiles = [[report.images.length, 'images']];
  const points = report.cloud ? report.cloud.num_points : report.cloud_not_shown && report.fusion ? report.fusion.points : -1;
  if (points >= 0) tiles.push([points.toLocaleString('en'), 'points in the cloud']);
  const measured = known(report.images.map(measuredOf));
  const geometric = known(report.images.map((i) => i.geometric));
  if (measured.length) tiles.push([percent(mean(measured)), 'of pixels measured']);
  if (geometric.length) tiles.push([percent(mean(geometric)), 'of pixels after filling']);
  const sizes = report.images.map((i) => i.pixel_size).filter((v) => v > 0);
  if (sizes.length) tiles.push([middle(sizes).toPrecision(3), 'world units a pixel (ground sampling distance)']);
  if (visibility) tiles.push([mean([...visibility.counts]).toFixed(1), 'images a point']);
  const baselines = report.images.map(baselineOverDepth).filter((v) => v !== null);
  if (baselines.length) tiles.push([middle(baselines).toFixed(2), 'baseline over depth']);
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
    row(r.finished, 'all', r.images_made, r.seconds);
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
  const table = (entries) => [['option', 'value'], ...entries.map(([k, v]) => [k, String(v)])];
  const chosen = Object.entries(report.chosen_options || {});
  byId('chosen-options').hidden = chosen.length === 0;
  byId('all-default').hidden = chosen.length > 0;
  if (chosen.length) fillTable(byId('chosen-options'), table(chosen));
  fillTable(byId('all-options'), table(options));
}


// Bars of equal width on a common ground; `label` names the bars that get one.
function histogram(title, unit, bars) {
  const width = 360, height = 222, left = 10, right = 10, top = 46, bottom = 44;
  const most = Math.max(...bars.map((b) => b.count)), step = (width - left - right) / bars.length;
  const sum = bars.reduce((a, b) => a + b.count, 0);
  let svg = `<text class="title" x="${left}" y="20">${title}</text>`;
  bars.forEach((bar, i) => {
    const h = (height - top - bottom) * bar.count / most, x = left + i * step;
    svg += `<rect class="bar-rect" x="${x}" y="${height - bottom - h}" width="${Math.max(1, step - 1)}" height="${h}">` +
      `<title>${bar.range}: ${(100 * bar.count / sum).toFixed(1)} %</title></rect>`;
    if (bar.count === most) {
      svg += `<text x="${x + step / 2}" y="${top - 5}" text-anchor="middle">${(100 * most / sum).toFixed(0)} %</text>`;
    }
    if (bar.label) svg += `<text x="${x + step / 2}" y="${height - bottom + 16}" text-anchor="middle">${bar.label}</text>`;
  });
  svg += `<text x="${width / 2}" y="${height - 8}" text-anchor="middle">${unit}</text>`;
  const element = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  element.setAttribute('viewBox', `0 0 ${width} ${height}`);
  element.setAttribute('role', 'img');
  element.setAttribute('aria-label', title);
  element.innerHTML = svg;
  return element;
}

// Without the last hundredth at either end.
function depthBars() {
  const counts = new Map();
  for (const image of report.images) {
    for (const [bin, count] of image.depth_histogram || []) counts.set(bin, (counts.get(bin) || 0) + count);
  }
  const bins = [...counts.keys()].sort((a, b) => a - b), sum = [...counts.values()].reduce((a, b) => a + b, 0);
  let below = 0, first = null, last = null;
  for (const bin of bins) {
    below += counts.get(bin);
    if (first === null && below > 0.01 * sum) first = bin;
    if (last === null && below >= 0.99 * sum) last = bin;
  }
  if (first === null) return [];
  const at = (bin) => 2 ** (bin / 8), number = last - first + 1;
  return Array.from({ length: number }, (unused, i) => {
    const bin = first + i, every = Math.max(1, Math.ceil(number / 6));
    return { count: counts.get(bin) || 0, range: `${at(bin).toPrecision(3)} to ${at(bin + 1).toPrecision(3)}`,
      label: i % every === 0 ? at(bin).toPrecision(2) : '' };
  });
}

function viewBars() {
  const counts = [];
  for (const count of visibility.counts) counts[count] = (counts[count] || 0) + 1;
  const most = Math.min(20, counts.length - 1), bars = [];
  for (let views = 1; views <= most; ++views) {
    const open = views === most && counts.length - 1 > most;
    const count = open ? counts.slice(most).reduce((a, b) => a + (b || 0), 0) : counts[views] || 0;
    bars.push({ count, range: `${views}${open ? ' or more' : ''} images`,
      label: most <= 10 || views % 2 === 0 ? views + (open ? '+' : '') : '' });
  }
  return bars;
}

function showFusion() {
  const fusion = report.fusion;
  if (!fusion) return;
  byId('fusion').hidden = false;
  const sum = Object.values(fusion.pixels).reduce((a, b) => a + b, 0);
  const rows = Object.entries(fusion.pixels).sort((a, b) => b[1] - a[1])
    .map(([reason, count]) => [reason, count.toLocaleString('en'), (100 * count / sum).toFixed(2)]);
  fillTable(byId('fusion-table'), [['what became of a pixel', 'pixels', '%'], ...rows]);
  byId('fusion-figures').textContent = `${fusion.points.toLocaleString('en')} points of ${fusion.images} images in ` +
    `${duration(fusion.seconds)}.` + (fusion.smoothing ? ` ${fusion.smoothing}.` : '');
  if (fusion.advice) report.warnings.push(`few pixels gave points: ${fusion.advice}`);
}

function showHistograms() {
  const depths = depthBars();
  if (depths.length) byId('histograms').append(histogram('Depths of all final maps', 'world units, logarithmic', depths));
  if (visibility) byId('histograms').append(histogram('Images that see a point', 'images', viewBars()));
  byId('survey').hidden = !byId('histograms').children.length;
}

showFusion();
showSummary();
showWarnings();
showHistograms();
showScores();
showTimes();
showSettings();
showImages();
showImageTable();
viewer.listen();
const cloudView = showCloud();
document.documentElement.dataset.ready = 'true';
