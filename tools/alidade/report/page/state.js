// SPDX-License-Identifier: Apache-2.0
// State of the page: hidden estimators, visible time, cursor. All figures follow it.

const page = {
  hidden: new Set(),
  focus: null,
  full: [0, 1],
  x: [0, 1],
  cursor: null,
  time: null,
  dark: false,
  listeners: [],
};

const shown = (name) => name === undefined || !page.hidden.has(name);
const dim = (name) => (page.focus && name !== undefined && name !== page.focus ? 0.16 : 1);

const plots = new Set();
let pending = false;

function redraw() {
  for (const p of plots) p.dirty = true;
  if (!pending) {
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      flush();
    });
  }
}

function flush(all) {
  for (const p of plots) if (p.dirty && (p.seen || all)) p.draw();
  page.listeners.forEach((f) => f());
}

function cursorMoved() {
  for (const p of plots) if (p.seen && p.paintOver) p.paintOver();
}

function setHidden(names) {
  page.hidden = new Set(names);
  redraw();
  saveHash();
}

function toggle(name, solo) {
  if (solo)
    setHidden(
      page.hidden.size === NAMES.length - 1 && !page.hidden.has(name)
        ? []
        : NAMES.filter((n) => n !== name),
    );
  else {
    const s = new Set(page.hidden);
    if (!s.delete(name)) s.add(name);
    setHidden(s);
  }
}

function zoomTo(a, b) {
  const span = page.full[1] - page.full[0];
  if (!(b - a > span * 1e-5)) return;
  page.x = b - a >= span ? page.full.slice() : [clamp(a, page.full[0], page.full[1] - (b - a)), 0];
  if (b - a < span) page.x[1] = page.x[0] + (b - a);
  redraw();
  saveHash();
}

function zoomBy(f, at) {
  const c = at === undefined || at === null ? (page.x[0] + page.x[1]) / 2 : at;
  zoomTo(c - (c - page.x[0]) * f, c + (page.x[1] - c) * f);
}

function goTo(t) {
  page.cursor = page.time = t;
  const w = Math.min(page.x[1] - page.x[0], (page.full[1] - page.full[0]) / 4);
  if (t < page.x[0] || t > page.x[1]) zoomTo(t - w / 2, t + w / 2);
  redraw();
}

const clock = (t) => String(+(t + T0).toFixed(3)).replace('-', '−');

const timeLink = (t) =>
  element(
    'button',
    {class: 't', title: 'show in the plots', onclick: () => goTo(t)},
    clock(t) + '\u202fs',
  );

let hashTimer = 0;

function saveHash() {
  clearTimeout(hashTimer);
  hashTimer = setTimeout(() => {
    const parts = [];
    if (page.x[0] > page.full[0] || page.x[1] < page.full[1])
      parts.push('t=' + page.x.map((v) => +v.toPrecision(7)).join(','));
    if (page.hidden.size) parts.push('off=' + [...page.hidden].map(encodeURIComponent).join(','));
    try {
      history.replaceState(null, '', parts.length ? '#' + parts.join('&') : location.pathname);
    } catch (e) {
      /* file: in some browsers */
    }
  }, 300);
}

function readHash() {
  for (const part of location.hash.slice(1).split('&')) {
    const [k, v] = part.split('=');
    if (k === 't') {
      const [a, b] = v.split(',').map(Number);
      if (b > a) page.x = [Math.max(a, page.full[0]), Math.min(b, page.full[1])];
    }
    if (k === 'off')
      page.hidden = new Set(
        v
          .split(',')
          .map(decodeURIComponent)
          .filter((n) => NAMES.includes(n)),
      );
    if (k === 'theme') setTheme(v === 'dark');
    if (k === 'at') page.time = page.cursor = Number(v);
  }
}
