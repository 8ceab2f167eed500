'use strict';
// Uses every control of the report as a reader would, and leaves in the page what changed, as JSON in the element "notes".
(() => {
  const notes = { errors: [] }, used = new Set();
  addEventListener('error', (e) => notes.errors.push(e.message || `${e.target.tagName} was not loaded`), true);
  addEventListener('unhandledrejection', (e) => notes.errors.push(`unhandled rejection: ${e.reason}`));
  const tell = console.error;
  console.error = (...words) => { notes.errors.push(words.join(' ')); tell.apply(console, words); };

  const get = (id) => document.getElementById(id);
  const texts = (selector) => [...document.querySelectorAll(selector)].map((e) => e.textContent);
  // Under virtual time a browser without a window hardly draws a frame.
  window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 10);
  const settle = () => new Promise((resolve) => setTimeout(resolve, 50));

  // A sum over the pixels of the cloud's view.
  async function picture() {
    await settle();
    const gl = get('cloud-canvas').getContext('webgl');
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl, bytes = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const error = gl.getError();
    if (error) notes.errors.push(`WebGL error ${error}`);
    let sum = 2166136261;
    for (const word of new Uint32Array(bytes.buffer)) sum = Math.imul(sum ^ word, 16777619);
    return (sum >>> 0).toString(16);
  }

  const middle = (box) => [box.left + box.width / 2, box.top + box.height / 2];

  // What lies at the place gets the event, as with a mouse.
  function point(type, element, [x, y], more = {}) {
    const hit = document.elementFromPoint(x, y);
    if (!hit || !element.contains(hit)) {
      notes.errors.push(`${element.id || element.outerHTML.slice(0, 80)} is covered or out of sight`);
      return;
    }
    const Kind = type.startsWith('pointer') ? PointerEvent : type === 'wheel' ? WheelEvent : MouseEvent;
    hit.dispatchEvent(new Kind(type, { bubbles: true, cancelable: true, clientX: x, clientY: y, pointerId: 1, ...more }));
  }
  function press(element, offset) {
    used.add(element);
    element.scrollIntoView({ behavior: 'instant', block: 'center', inline: 'center' });
    const box = element.getBoundingClientRect(), place = offset ? [box.left + offset[0], box.top + offset[1]] : middle(box);
    point('pointerdown', element, place, { buttons: 1 });
    point('pointerup', element, place);
    point('click', element, place);
  }
  function drag(element, dx, dy, more = {}) {
    const [x, y] = middle(element.getBoundingClientRect());
    point('pointerdown', element, [x, y], { buttons: 1, ...more });
    point('pointermove', element, [x + dx, y + dy], { buttons: 1, ...more });
    point('pointerup', element, [x + dx, y + dy], more);
  }
  const key = (name) => document.activeElement.dispatchEvent(
    new KeyboardEvent('keydown', { key: name, bubbles: true, cancelable: true }));
  function change(element, value, type) {
    used.add(element);
    element.value = value;
    element.dispatchEvent(new Event(type, { bubbles: true }));
  }

  // Pictures of the cloud, each after one act, as pairs of the act and the picture.
  async function cloudPictures() {
    const canvas = get('cloud-canvas'), colors = get('cloud-colors');
    canvas.scrollIntoView({ behavior: 'instant', block: 'center' });
    notes.start = await picture();
    notes.colors = [];
    for (const option of [...colors.options]) {
      change(colors, option.value, 'change');
      notes.colors.push([option.text, await picture(), get('cloud-legend').textContent]);
    }
    change(colors, 0, 'change');
    notes.views = [['start', await picture()]];
    const view = async (name, act) => { act(); notes.views.push([name, await picture()]); };
    canvas.focus();
    for (const name of ['ArrowLeft', 'ArrowUp', 'ArrowRight', 'ArrowDown', '+', '-', '-']) await view(name, () => key(name));
    key('0');
    notes.after_zero = await picture();
    await view('wheel', () => point('wheel', canvas, middle(canvas.getBoundingClientRect()), { deltaY: 120 }));
    await view('drag', () => drag(canvas, 40, 10));
    await view('right drag', () => drag(canvas, 40, 10, { button: 2, buttons: 2 }));
    await view('point size', () => change(get('cloud-size'), 5, 'input'));
    await view('no cameras', () => press(get('cloud-cameras')));
    change(get('cloud-size'), 2, 'input');
    press(get('cloud-cameras'));
    press(get('cloud-reset'));
    notes.after_reset = await picture();
  }

  const inside = (place, canvas) => place && place[0] > 20 && place[1] > 20 && place[0] < canvas.clientWidth - 20 &&
    place[1] < canvas.clientHeight - 20;

  // The first place where nothing else is near.
  function lonely(what, number) {
    const canvas = get('cloud-canvas');
    const places = Array.from({ length: number }, (unused, i) => cloudView.placeOf(what, i));
    const far = (p, q) => !q || p === q || Math.hypot(p[0] - q[0], p[1] - q[1]) > 20;
    const found = places.findIndex((p) => inside(p, canvas) && places.every((q) => far(p, q)));
    return { index: found, place: places[found] };
  }

  async function cloudClicks() {
    const canvas = get('cloud-canvas');
    canvas.focus();
    for (let i = 0; i < 6; ++i) key('-');
    await settle();
    press(get('cloud-cameras'));  // so that no camera lies before the point
    const before = await picture(), seen = lonely('point', report.cloud.num_shown);
    press(canvas, seen.place);
    const after = await picture();
    notes.point = { marked: before !== after, text: get('cloud-info').textContent, images: texts('#cloud-info a') };
    press(get('cloud-info').querySelector('a'));
    notes.point.opened = report.images[get('image-choice').value].name;
    press(canvas, [3, 3]);
    notes.no_point = get('cloud-info').textContent;
    press(get('cloud-cameras'));
    const camera = lonely('camera', report.cloud.cameras.length);
    press(canvas, camera.place);
    notes.camera = { wanted: report.cloud.cameras[camera.index].name, opened: report.images[get('image-choice').value].name };
  }

  const shownImage = () => ({ name: report.images[get('image-choice').value].name,
    thumbnail: texts('.thumbnail[aria-current="true"] span').join(), pictures: texts('#pictures figcaption b') });

  async function images() {
    notes.images = [];
    const note = (act, wanted) => notes.images.push({ act, wanted, ...shownImage() });
    for (const thumbnail of document.querySelectorAll('.thumbnail')) {
      press(thumbnail);
      note('thumbnail', thumbnail.querySelector('span').textContent);
    }
    const names = report.images.map((image) => image.name);
    press(get('next'));
    note('next', names[0]);
    press(get('previous'));
    note('previous', names[names.length - 1]);
    change(get('image-choice'), 1, 'change');
    note('choice', names[1]);
    for (const where of ['#image-neighbours', '#image-table']) {
      const link = document.querySelector(`${where} a`), name = link.textContent;
      press(link);
      note(where, name);
    }
  }

  async function enlarged() {
    const box = () => { const b = get('viewer-picture').getBoundingClientRect(); return [b.left, b.top, b.width].map(Math.round); };
    const state = () => ({ layer: texts('#viewer-layers [aria-pressed="true"]').join(), box: box(), caption: get('viewer-caption').textContent });
    const stage = get('viewer-stage'), open = async () => { press(document.querySelector('#pictures button')); await settle(); };
    await open();
    notes.viewer = { layers: texts('#viewer-layers button'), keys: [], buttons: [] };
    for (let i = 0; i < notes.viewer.layers.length; ++i) {
      notes.viewer.keys.push(state());
      key('ArrowRight');
      await settle();
    }
    key('ArrowLeft');
    notes.viewer.left = state().layer;
    for (const button of get('viewer-layers').children) {
      press(button);
      await settle();
      notes.viewer.buttons.push(state());
    }
    notes.viewer.fit = box();
    point('wheel', stage, middle(stage.getBoundingClientRect()), { deltaY: -200 });
    notes.viewer.wheel = box();
    drag(stage, 30, 20);
    notes.viewer.drag = box();
    point('dblclick', stage, middle(stage.getBoundingClientRect()));
    notes.viewer.again = box();
    key('Escape');
    notes.viewer.escape = get('viewer').hidden;
    await open();
    notes.viewer.reopened = !get('viewer').hidden;
    press(get('viewer-close'));
    notes.viewer.closed = get('viewer').hidden;
  }

  // Twice on every heading: the images' names from top to bottom.
  function sorting() {
    const order = () => texts('#image-table td:first-child');
    notes.sorting = {};
    for (const button of document.querySelectorAll('#image-table .sort')) {
      const orders = [0, 1].map(() => { press(button); return order(); });
      notes.sorting[button.textContent] = { ascending: orders[0], descending: orders[1], mark: button.parentNode.getAttribute('aria-sort') };
    }
  }

  function details() {
    notes.details = [...document.querySelectorAll('summary')].map((summary) => {
      press(summary);
      const table = summary.parentNode.querySelector('table');
      return { rows: table.rows.length, height: table.getBoundingClientRect().height };
    });
  }

  addEventListener('load', async () => {
    try {
      for (const part of [cloudPictures, cloudClicks, images, enlarged, sorting, details]) {
        notes.part = part.name;
        await part();
        if (notes.errors.length) break;  // others would follow from these
      }
      notes.unused = [...document.querySelectorAll('button[id], select, input, summary, .sort, .thumbnail')]
        .filter((control) => !used.has(control)).map((control) => control.id || control.textContent);
      if (!notes.errors.length) notes.part = 'end';
    } catch (error) {
      notes.errors.push(`in ${notes.part}: ${error.stack}`);
    }
    const pre = document.createElement('pre');
    pre.id = 'notes';
    pre.textContent = JSON.stringify(notes).replace(/[<>&]/g, (c) => '\\u00' + c.charCodeAt(0).toString(16));
    document.body.append(pre);
  });
})();
