'use strict';
// What is around the cloud's view: colours, legend, what was clicked; and who sees what.

// Stops of OpenCV's palettes, as the pictures of the maps have them.
const palettes = {
  viridis: ['#440154', '#443a83', '#31688e', '#21908c', '#35b779', '#8fd744', '#fde725'],
  turbo: ['#30123b', '#4675ed', '#1bcfd4', '#61fc6c', '#d1e834', '#fe9b2d', '#d93806', '#7a0403'],
  inferno: ['#000004', '#320a5e', '#781c6d', '#bb3654', '#ec6824', '#fbb41a', '#fcffa4'],
};
const hexColor = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

function paletteColor(name, share) {
  const stops = palettes[name], at = Math.min(0.99999, Math.max(0, share)) * (stops.length - 1), k = Math.floor(at);
  const [a, b] = [hexColor(stops[k]), hexColor(stops[k + 1])];
  return a.map((v, c) => Math.round(v + (at - k) * (b[c] - v)));
}

function makeLegend([palette, from, to]) {
  const legend = make('span', 'legend'), bar = make('span', 'gradient');
  bar.style.background = `linear-gradient(to right, ${palettes[palette].join(', ')})`;
  legend.append(make('span', '', from), bar, make('span', '', to));
  return legend;
}

// The images that see each shown point.
const visibility = (() => {
  const cloud = report.cloud;
  if (!cloud || !cloud.view_counts) return null;
  const counts = decodeBytes(cloud.view_counts), views = new Uint16Array(decodeBytes(cloud.views).buffer);
  const begins = new Uint32Array(counts.length + 1);
  counts.forEach((count, i) => { begins[i + 1] = begins[i] + count; });
  return { counts, of: (point) => [...views.subarray(begins[point], begins[point + 1])] };
})();

// By image: the others with the most points in common, and how many.
const neighbours = (() => {
  const number = report.cloud ? report.cloud.cameras.length : 0;
  if (!visibility || number > 2000) return [];
  const shared = Array.from({ length: number }, () => new Map());
  visibility.counts.forEach((count, point) => {
    const views = visibility.of(point).filter((v) => v < number);
    for (const a of views) for (const b of views) if (a !== b) shared[a].set(b, (shared[a].get(b) || 0) + 1);
  });
  return shared.map((m) => [...m.entries()].sort((a, b) => b[1] - a[1]));
})();

// Of the neighbours that share most points: distance of the two cameras over the median depth.
function baselineOverDepth(image) {
  const best = (neighbours[image.view] || []).slice(0, 8), cameras = report.cloud ? report.cloud.cameras : [];
  if (!best.length || !(image.depths[1] > 0)) return null;
  const ratios = best.map(([other]) =>
    Math.hypot(...vec.add(cameras[image.view].center, cameras[other].center, -1)) / image.depths[1]);
  return ratios.sort((a, b) => a - b)[ratios.length >> 1];
}

function cloudColorings(cloud) {
  const number = cloud.num_shown;
  const paint = (color) => {
    const colors = new Uint8Array(3 * number);
    for (let i = 0; i < number; ++i) colors.set(color(i), 3 * i);
    return colors;
  };
  const all = [{ name: 'Photo colours', key: '', colors: () => decodeBytes(cloud.colors) }];
  if (cloud.inferred) {
    const inferred = decodeBytes(cloud.inferred), key = make('span');
    key.append(make('span', 'key measured'), ' measured ', make('span', 'key filled'), ' inferred');
    all.push({ name: 'Measured or inferred', key, colors: () => paint((i) => (inferred[i] ? [232, 163, 61] : [42, 120, 184])) });
  }
  if (cloud.confidences) {
    const confidences = decodeBytes(cloud.confidences), least = 50;
    all.push({ name: 'Confidence', key: makeLegend(['viridis', `${least} % or less`, '100 %']),
      colors: () => paint((i) => paletteColor('viridis', (confidences[i] - least) / (100 - least))) });
  }
  if (cloud.normals) {
    const normals = new Int8Array(decodeBytes(cloud.normals).buffer);
    all.push({ name: 'Normals', key: 'red, green, blue: along the axes x, y, z of the world',
      colors: () => paint((i) => [0, 1, 2].map((c) => 128 + normals[3 * i + c])) });
  }
  if (visibility) {
    const most = Math.max(3, [...visibility.counts].sort((a, b) => a - b)[Math.floor(0.98 * (number - 1))]);
    all.push({ name: 'Number of images', key: makeLegend(['viridis', '1', `${most} images or more`]),
      colors: () => paint((i) => paletteColor('viridis', (visibility.counts[i] - 1) / (most - 1))) });
  }
  if (cloud.errors) {
    const errors = decodeBytes(cloud.errors);
    all.push({ name: 'Error to truth', key: makeLegend(['viridis', '0', `${(254 * cloud.error_unit * 100).toFixed(0)} % of the depth or more; grey: no truth`]),
      colors: () => paint((i) => (errors[i] === 255 ? [110, 110, 110] : paletteColor('viridis', errors[i] / 254))) });
  }
  return all;
}

function showPoint(view, point) {
  const cloud = report.cloud, info = byId('cloud-info');
  if (point === null) {
    view.choose(null);
    view.markCameras([]);
    info.replaceChildren('Click a point or a camera.');
    return;
  }
  const positions = new Int16Array(decodeBytes(cloud.positions).buffer);
  const xyz = [0, 1, 2].map((a) => cloud.center[a] + cloud.scale * positions[3 * point + a] / 32767);
  const parts = [`Point at ${xyz.map((v) => v.toPrecision(5)).join(', ')}`];
  if (cloud.inferred) parts.push(decodeBytes(cloud.inferred)[point] ? 'inferred' : 'measured');
  if (cloud.confidences) parts.push(`confidence ${decodeBytes(cloud.confidences)[point]} %`);
  if (cloud.errors) {
    const error = decodeBytes(cloud.errors)[point];
    if (error < 255) {
      parts.push(`error to truth ${(100 * error * cloud.error_unit).toFixed(2)} % of the depth${error === 254 ? ' or more' : ''}`);
    }
  }
  const views = visibility ? visibility.of(point).filter((v) => v < cloud.cameras.length) : [];
  view.choose(point, views);
  view.markCameras(views);
  info.replaceChildren(make('span', '', parts.join(', ') + (views.length ? `; seen by ${views.length} images: ` : '')));
  for (const v of views) info.append(imageLink(v), ' ');
}

function showCloud() {
  const cloud = report.cloud;
  if (report.cloud_not_shown) {
    byId('cloud').hidden = false;
    byId('cloud-controls').hidden = true;
    byId('cloud-caption').textContent = `The points are in ${report.cloud_not_shown}. A report shows those of one PLY only.`;
  }
  if (!cloud || !cloud.num_shown) return null;
  byId('cloud').hidden = false;
  const few = cloud.num_shown < cloud.num_points ? `${cloud.num_shown.toLocaleString('en')} of ` : '';
  byId('cloud-caption').textContent = `${few}${cloud.num_points.toLocaleString('en')} points of ${cloud.file}` +
    (cloud.num_files > 1 ? ` and the files it goes on in; those shown are of this first of ${cloud.num_files}` : '') +
    (few ? ', chosen at random. ' : '. ') + 'Drag to turn, scroll or pinch to zoom, right-drag or two fingers to move; ' +
    'with the keyboard: arrows, +, - and 0.';
  const view = startCloudView(byId('cloud-canvas'), cloud, {
    point: (point) => showPoint(view, point),
    camera: (camera) => { view.markCameras([camera]); openImage(camera); },
  });
  if (!view) {
    byId('cloud-caption').textContent += ' This browser has no WebGL, so the view stays empty.';
    return null;
  }
  const colorings = cloudColorings(cloud), choice = byId('cloud-colors');
  colorings.forEach((c, i) => choice.append(new Option(c.name, i)));
  choice.onchange = () => {
    const coloring = colorings[choice.value];
    view.setColors(coloring.colors());
    byId('cloud-legend').replaceChildren(coloring.key);
  };
  byId('cloud-reset').onclick = () => view.reset();
  byId('cloud-size').oninput = (e) => view.setPointSize(+e.target.value);
  byId('cloud-cameras').onchange = (e) => view.showCameras(e.target.checked);
  showPoint(view, null);
  return view;
}
