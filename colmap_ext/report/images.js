'use strict';
// The images of the report: overview, one image with its maps, statistics and neighbours, and the table of all.

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
    picture.style.width = picture.style.height = '';
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
    if (p.legend) byId('viewer-caption').append(makeLegend(p.legend));
    [...byId('viewer-layers').children].forEach((b, i) => b.setAttribute('aria-pressed', i === this.layer));
  },
  fit() {
    const stage = byId('viewer-stage').getBoundingClientRect(), picture = byId('viewer-picture');
    // Maps may have fewer pixels than the photo: all layers fill the frame of the one that is shown first.
    const width = picture.offsetWidth, height = picture.offsetHeight;
    picture.style.width = `${width}px`;
    picture.style.height = `${height}px`;
    this.scale = Math.min(stage.width / width, stage.height / height);
    this.x = (stage.width - this.scale * width) / 2;
    this.y = (stage.height - this.scale * height) / 2;
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
      capturePointer(stage, e);
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

const imageOfView = new Map(report.images.map((image) => [image.view, image]));
const shownImages = report.images.filter((image) => image.pictures.length);

// A name that opens the image.
function imageLink(view, text) {
  const image = imageOfView.get(view);
  const link = make('a', 'image-link', text || (image ? image.name : `image ${view}`));
  link.href = '#image';
  link.onclick = (e) => { e.preventDefault(); openImage(view); };
  return link;
}

function imageStatistics(image) {
  const rows = [];
  const add = (name, value) => { if (value !== null && value !== undefined && value !== '') rows.push([name, value]); };
  const shares = [['raw', image.photometric], ['measured', image.measured], ['final', image.geometric],
    ['inferred', image.filled]].filter(([, v]) => v >= 0);
  add('pixels with a depth', shares.map(([k, v]) => `${k} ${percent(v)}`).join(', '));
  if (image.width) add('size of the maps', `${image.width} x ${image.height} pixels`);
  if (image.depths[1] > 0) {
    add('depth (2nd, 50th, 98th percentile)', image.depths.map((d) => d.toPrecision(4)).join(', ') + ' world units');
    add('size of a pixel on the surface', image.pixel_size.toPrecision(3) + ' world units at the median depth');
  }
  const ratio = baselineOverDepth(image);
  if (ratio !== null) add('baseline over depth', `${ratio.toFixed(3)} to the neighbours (median)`);
  return rows;
}

function showPictures(image) {
  byId('pictures').replaceChildren(...image.pictures.map((p, i) => {
    const figure = make('figure'), button = make('button'), picture = make('img');
    picture.src = p.uri;
    picture.alt = `${p.title} of ${image.name}`;
    button.append(picture);
    button.title = 'Enlarge';
    button.onclick = () => viewer.open(image, i);
    const caption = make('figcaption', '', p.caption);
    caption.prepend(make('b', '', p.title));
    if (p.legend) caption.append(makeLegend(p.legend));
    figure.append(button, caption);
    return figure;
  }));
}

function showImage(image) {
  const statistics = byId('image-statistics');
  statistics.replaceChildren();
  fillList(statistics, imageStatistics(image));
  const near = (neighbours[image.view] || []).slice(0, 10);
  byId('image-neighbours').replaceChildren(...(near.length ? ['Neighbours, by shared points: '] : []),
    ...near.flatMap(([view, count], i) => [i ? ', ' : '', imageLink(view), ` (${count.toLocaleString('en')})`]));
  byId('image-warnings').replaceChildren(...image.warnings.map((w) => make('li', '', w)));
  showPictures(image);
  document.querySelectorAll('.thumbnail').forEach((t) =>
    t.setAttribute('aria-current', t.dataset.view === String(image.view)));
  if (!image.pictures.length) {
    byId('pictures').replaceChildren(make('p', 'quiet', 'No pictures of this image: --max_images says of how many there are some.'));
  }
}

let currentImage = 0;  // index into report.images
function go(index) {
  currentImage = (index + report.images.length) % report.images.length;
  byId('image-choice').value = currentImage;
  showImage(report.images[currentImage]);
}

// By the workspace's index.
function openImage(view) {
  const index = report.images.findIndex((image) => image.view === view);
  if (index < 0) return;
  go(index);
  byId('image').scrollIntoView({ behavior: 'smooth', block: 'start' });
}

function showThumbnails() {
  byId('overview').hidden = shownImages.length === 0;
  byId('thumbnails').replaceChildren(...shownImages.map((image) => {
    const button = make('button', 'thumbnail'), picture = make('img');
    const photo = image.pictures.find((p) => p.title === 'Input') || image.pictures[0];
    picture.src = photo.uri;
    picture.alt = '';
    picture.loading = 'lazy';
    button.dataset.view = image.view;
    button.title = image.name;
    const total = image.geometric >= 0 ? image.geometric : Math.max(0, measuredOf(image));
    button.append(picture, make('span', '', image.name), make('i', '', percent(total)));
    button.onclick = () => openImage(image.view);
    return button;
  }));
}

function showImages() {
  if (!report.images.length) return;
  byId('image').hidden = false;
  report.images.forEach((image, i) =>
    byId('image-choice').append(new Option(`${image.name} (${i + 1} of ${report.images.length})`, i)));
  byId('image-choice').onchange = (e) => go(+e.target.value);
  byId('previous').onclick = () => go(currentImage - 1);
  byId('next').onclick = () => go(currentImage + 1);
  showThumbnails();
  go(Math.max(0, report.images.indexOf(shownImages[0])));
}

// Sorted by a click on a heading; columns without a value in any row are left out.
function sortableTable(table, columns, rows) {
  const used = columns.filter((column) => rows.some((row) => column.value(row) !== null));
  const head = make('tr');
  const fill = (sorted) => {
    table.replaceChildren(head, ...sorted.map((row) => {
      const line = make('tr');
      for (const column of used) {
        const cell = make('td'), value = column.value(row);
        cell.append(column.cell ? column.cell(row) : value === null ? '' : column.text ? column.text(value) : String(value));
        line.append(cell);
      }
      return line;
    }));
  };
  let last = null, ascending = true;
  used.forEach((column) => {
    const cell = make('th'), button = make('button', 'sort', column.name);
    button.title = column.title || `Sort by ${column.name}`;
    button.onclick = () => {
      ascending = last === column ? !ascending : true;
      last = column;
      const sign = ascending ? 1 : -1;  // rows without a value come last either way
      const order = (a, b) => (a === b ? 0 : a === null ? 1 : b === null ? -1 : a < b ? -sign : sign);
      fill([...rows].sort((a, b) => order(column.value(a), column.value(b))));
      head.querySelectorAll('th').forEach((th) => th.removeAttribute('aria-sort'));
      cell.setAttribute('aria-sort', ascending ? 'ascending' : 'descending');
    };
    cell.append(button);
    head.append(cell);
  });
  fill(rows);
}

// Measured and inferred pixels of the final map.
function coverageBar(image) {
  const total = image.geometric >= 0 ? image.geometric : Math.max(0, measuredOf(image));
  const filled = Math.max(0, image.filled), bar = make('div', 'bar');
  for (const [name, share] of [['measured', total - filled], ['filled', filled]]) {
    const part = make('div', name);
    part.style.width = share + '%';
    bar.append(part);
  }
  return bar;
}

function showImageTable() {
  const share = (key) => ({ value: (image) => (image[key] >= 0 ? image[key] : null), text: (v) => v.toFixed(1) });
  sortableTable(byId('image-table'), [
    { name: 'image', value: (image) => image.name, cell: (image) => imageLink(image.view) },
    { name: 'raw %', title: 'Pixels with a depth before the filter', ...share('photometric') },
    { name: 'measured %', title: 'Pixels that other images confirm', ...share('measured') },
    { name: 'inferred %', title: 'Pixels whose depth was inferred', ...share('filled') },
    { name: 'final %', title: 'Pixels with a depth', ...share('geometric') },
    { name: 'coverage', title: 'Blue: measured, orange: inferred', value: (i) => (i.geometric >= 0 ? i.geometric : null), cell: coverageBar },
    { name: 'median depth', title: 'World units', value: (i) => i.depths[1] || null, text: (v) => v.toPrecision(4) },
    { name: 'pixel size', title: 'On the surface, world units, at the median depth', value: (i) => i.pixel_size || null, text: (v) => v.toPrecision(3) },
    { name: 'baseline / depth', title: 'To the neighbours with the most shared points, median', value: baselineOverDepth, text: (v) => v.toFixed(3) },
    { name: 'neighbours', title: 'Images with shared points', value: (i) => (neighbours[i.view] ? neighbours[i.view].length : null) },
    { name: 'warnings', value: (i) => i.warnings.length || null },
  ], report.images);
}
