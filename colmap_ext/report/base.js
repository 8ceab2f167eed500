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

// Columns that are empty but for their heading are left out.
function fillTable(table, all) {
  const used = all[0].map((unused, column) => all.slice(1).some((row) => row[column] !== '' && row[column] !== null));
  const rows = all.map((row) => row.filter((cell, column) => used[column]));
  rows.forEach((cells, r) => {
    const row = make('tr');
    for (const cell of cells) row.append(make(r === 0 ? 'th' : 'td', '', cell));
    table.append(row);
  });
}

// Pairs of a name and a value.
function fillList(list, rows) {
  for (const [name, value] of rows) list.append(make('dt', '', name), make('dd', '', value));
}

const middle = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

// A drag goes on outside of the element.
function capturePointer(element, event) {
  try { element.setPointerCapture(event.pointerId); } catch (error) { /* it was lifted already, or a script made it */ }
}
