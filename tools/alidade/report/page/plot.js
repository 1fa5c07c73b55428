// SPDX-License-Identifier: Apache-2.0
// Plot: axes, layers and pointer of one panel.

const observer = new IntersectionObserver(
  (entries) => {
    for (const e of entries) {
      const p = e.target.plot;
      p.seen = e.isIntersecting;
      if (p.seen && p.dirty) p.draw();
    }
  },
  {rootMargin: '250px'},
);

const resizer = new ResizeObserver((entries) => {
  for (const e of entries) {
    e.target.plot.dirty = true;
    if (e.target.plot.seen) e.target.plot.draw();
  }
});

/**
 * A plot. spec: {label, name, height, time, first, last, zero, left, x, y, layers()}.
 *
 *   time     true: the x axis is the visible time of the page
 *   last     false: no time labels, because another plot is below
 *   zero     true: the y axis is symmetric about zero
 *   equal    true: both axes have the same scale
 *   x, y     {label, unit, log, range(layers), ticks}; y.rows: names of categories at 0, 1, ...
 *   values() the contents of a CSV file, if the layers have none
 *   layers() the layers at present: {kind, x, y, ...}; kind is line, band, dots, h, v, hband or
 *            custom. `est` is the estimator of a layer, `tip(i)` the content of its tip
 *
 * Numbers are in SI units. The axis selects the prefix of the unit.
 */
class Plot {
  constructor(spec) {
    this.spec = spec;
    this.dirty = true;
    this.seen = false;
    this.full = false;
    this.base = element('canvas', {class: 'base', 'aria-hidden': 'true'});
    this.over = element('canvas', {
      class: 'over',
      tabindex: 0,
      role: 'img',
      'aria-label':
        (spec.name || spec.label || 'plot') +
        (spec.time ? '. Arrow keys move the cursor, plus and minus zoom, 0 shows all.' : ''),
    });
    this.el = element(
      'div',
      {class: 'plot ' + (spec.time ? 'time' : 'xy'), style: `height:${spec.height || 130}px`},
      this.base,
      this.over,
    );
    this.el.plot = this;
    plots.add(this);
    observer.observe(this.el);
    resizer.observe(this.el);
    if (spec.time) followTime(this);
    else followDots(this);
  }

  /** Sets the visible layers, the frame and the scales. y is fitted to what matters, or to all. */
  prepare(width, height) {
    const {spec} = this;
    const x = spec.x || {};
    const isNarrow = width < 520;
    this.layers = spec.layers().filter((L) => L && shown(L.est));
    this.f = {
      l: spec.left || (isNarrow ? 46 : 62),
      r: width - (isNarrow ? 8 : 14),
      t: spec.label ? 19 : 8,
      b: height - (spec.last === false ? 5 : x.label || spec.time ? 34 : 22),
    };
    const {l, r, t, b} = this.f;
    let xRange = spec.time ? page.x : this.xRange(x);
    let yRange = this.yRange();
    if (spec.equal) [xRange, yRange] = equalRanges(xRange, yRange, r - l, b - t);
    this.X = scale(...xRange, l, r, x.log && !spec.time);
    this.Y = scale(...yRange, b, t, spec.y.log);
    const size = Math.max(Math.abs(yRange[0]), Math.abs(yRange[1]));
    [this.factor, this.unit] = unitFor(spec.y.unit, size);
  }

  xRange(x) {
    return x.range ? x.range(this.layers) : extentOf(this.layers, 'x', x.log);
  }

  yRange() {
    const {spec} = this;
    let [lo, hi] = spec.y.range
      ? spec.y.range(this.layers, this.full)
      : spec.time
        ? fittedRange(this, page.x)
        : extentOf(this.layers, 'y', spec.y.log);
    if (spec.y.log && !(lo > 0)) [lo, hi] = [hi / 1e4 || 1e-3, hi || 1];
    if (hi > lo) return [lo, hi];
    const half = Math.abs(lo) * 0.1 || 1;
    return [lo - half, lo + half];
  }

  draw() {
    const width = this.el.clientWidth;
    const height = this.el.clientHeight;
    if (!width || !height) return;
    this.dpr = window.devicePixelRatio || 1;
    for (const canvas of [this.base, this.over]) {
      const [w, h] = [Math.round(width * this.dpr), Math.round(height * this.dpr)];
      if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    }
    const context = this.base.getContext('2d');
    context.setTransform(this.dpr, 0, 0, this.dpr, 0, 0);
    context.clearRect(0, 0, width, height);
    this.paint(new CanvasSurface(context), width, height);
    this.dirty = false;
    this.paintOver();
    if (this.onPainted) this.onPainted();
  }

  /** Paints everything except cursor and selection, on a canvas or as SVG. */
  paint(surface, width, height) {
    this.prepare(width, height);
    const {spec, f} = this;
    if (spec.y.rows) paintRows(surface, this);
    else paintYTicks(surface, this);
    paintXAxis(surface, this);
    paintSegments(surface, this);
    surface.clip(f.l, f.t, f.r - f.l, f.b - f.t);
    this.lost = new Set();
    for (const layer of this.layers) LAYER_PAINTERS[layer.kind](surface, layer, this);
    surface.unclip();
    paintEvents(surface, this);
    surface.path([f.l, f.b + 0.5, f.r, f.b + 0.5], {stroke: colours.line});
    if (!spec.label) return;
    const label = spec.label + (this.unit ? ` [${this.unit}]` : '');
    surface.text(label, f.l, 8, {weight: 600, size: 12, color: colours.ink});
  }

  /** Paints the selection, the cursor and the dot below the pointer. */
  paintOver() {
    const context = this.over.getContext('2d');
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.over.width, this.over.height);
    if (!this.f) return;
    context.setTransform(this.dpr, 0, 0, this.dpr, 0, 0);
    const surface = new CanvasSurface(context);
    if (this.hit) surface.marks(this.hit.place, 'dot', 6, {stroke: colours.ink, width: 1.5});
    if (!this.spec.time) return;
    const {t, b} = this.f;
    if (this.drag && Math.abs(this.drag[1] - this.drag[0]) > 3) {
      const left = Math.min(...this.drag);
      const width = Math.abs(this.drag[1] - this.drag[0]);
      surface.rect(left, t, width, b - t, {fill: colours.accent, alpha: 0.18});
    }
    const time = page.cursor ?? page.time;
    if (time !== null && time >= page.x[0] && time <= page.x[1]) this.paintCursor(surface, time);
  }

  paintCursor(surface, time) {
    const {t, b} = this.f;
    const x = Math.round(this.X.to(time)) + 0.5;
    surface.path([x, t, x, b], {stroke: colours.muted, width: 1});
    for (const L of this.layers) {
      if (L.kind !== 'line' || !L.name) continue;
      const i = nearest(L.x, time);
      const y = this.Y.to(L.y[i]);
      if (y < t || y > b) continue;
      surface.marks([this.X.to(L.x[i]), y], 'dot', 3, {fill: colourOfLayer(L)});
    }
  }

  /** The rows of a CSV file with the visible layers, in SI units. */
  csv() {
    const {spec} = this;
    const units = [spec.time ? 's' : (spec.x && spec.x.unit) || '', spec.y.unit || ''].map(csvCell);
    const layers = spec.values ? spec.values().filter(({est}) => shown(est)) : this.layers;
    const rows = [];
    for (const L of layers.filter(({x, y}) => x && y)) {
      const name = unique([L.est, L.name].filter(Boolean)).join(' ') || L.kind;
      const start = [spec.label || spec.name || '', name].map(csvCell);
      for (let i = 0; i < L.x.length; i++) {
        if (L.only && !L.only(i)) continue;
        const x = L.x[i] + (spec.time ? T0 : 0);
        const y = Number.isNaN(L.y[i]) ? '' : L.y[i];
        rows.push([...start, x, y, L.s ? L.s[i] : '', ...units].join(','));
      }
    }
    return rows;
  }
}

/** A text as a cell of a CSV file. */
const csvCell = (text) => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);

function dispose(ps) {
  for (const p of ps) {
    plots.delete(p);
    observer.unobserve(p.el);
    resizer.unobserve(p.el);
  }
}
