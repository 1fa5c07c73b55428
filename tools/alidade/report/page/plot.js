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

const colourOfLayer = (layer) => (layer.color ? layer.color() : colorOf(layer.est));

/**
 * A plot. spec: {label, name, height, time, first, last, zero, left, x, y, layers()}.
 *
 *   time     true: the x axis is the visible time of the page
 *   last     false: no time labels, because another plot is below
 *   zero     true: the y axis is symmetric about zero
 *   x, y     {label, unit, log, range(layers), ticks}; y.rows: names of categories at 0, 1, ...
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
    this.pointer();
  }
  /** Layers with their ranges; y is fitted to what matters, or (full) to all. */
  prepare(w, hh) {
    const sp = this.spec;
    const narrow = w < 520;
    this.layers = sp.layers().filter((L) => L && shown(L.est));
    const left = sp.left || (narrow ? 46 : 62);
    const f = {
      l: left,
      r: w - (sp.right || (narrow ? 8 : 14)),
      t: sp.label ? 19 : 8,
      b: hh - (sp.last === false ? 5 : (sp.x && sp.x.label) || sp.time ? 34 : 22),
    };
    this.f = f;
    const x = sp.x || {};
    const xr = sp.time ? page.x : x.range ? x.range(this.layers) : this.extent('x', x.log);
    this.X = scale(xr[0], xr[1], f.l, f.r, x.log && !sp.time);
    let yr = sp.y.range
      ? sp.y.range(this.layers, this.full)
      : sp.time
        ? this.fit(xr)
        : this.extent('y', sp.y.log);
    if (sp.y.log && !(yr[0] > 0)) yr = [yr[1] / 1e4 || 1e-3, yr[1] || 1];
    if (!(yr[1] > yr[0])) {
      const d = Math.abs(yr[0]) * 0.1 || 1;
      yr = [yr[0] - d, yr[1] + d];
    }
    if (sp.equal) {
      // one scale on both axes
      const k = Math.max((xr[1] - xr[0]) / (f.r - f.l), (yr[1] - yr[0]) / (f.b - f.t));
      const cx = (xr[0] + xr[1]) / 2;
      const cy = (yr[0] + yr[1]) / 2;
      this.X = scale(cx - (k * (f.r - f.l)) / 2, cx + (k * (f.r - f.l)) / 2, f.l, f.r);
      yr = [cy - (k * (f.b - f.t)) / 2, cy + (k * (f.b - f.t)) / 2];
    }
    this.Y = scale(yr[0], yr[1], f.b, f.t, sp.y.log);
    const size = Math.max(Math.abs(yr[0]), Math.abs(yr[1]));
    const [k, unit] = unitFor(sp.y.unit, size);
    this.factor = k;
    this.unit = unit;
  }
  extent(axis, log) {
    let lo = Infinity;
    let hi = -Infinity;
    for (const L of this.layers)
      for (const a of axis === 'x' ? [L.x, L.x2] : [L.y, L.lo, L.hi])
        if (a && L.fit !== false)
          for (const v of a)
            if (v === v && Number.isFinite(v) && (!log || v > 0)) {
              if (v < lo) lo = v;
              if (v > hi) hi = v;
            }
    if (!(hi >= lo)) return log ? [0.1, 10] : [0, 1];
    if (log) {
      const p = (hi / lo) ** 0.05 * 1.02;
      return [lo / p, hi * p];
    }
    const p = (hi - lo) * 0.05 || Math.abs(hi) * 0.1 || 1;
    return [lo - p, hi + p];
  }
  fit(xr) {
    const sp = this.spec;
    const sample = (L, get, ps) => {
      const i0 = lower(L.x, xr[0]);
      const i1 = lower(L.x, xr[1] + 1e-12);
      const step = Math.max(1, Math.floor((i1 - i0) / 1500));
      const v = [];
      for (let i = i0; i < i1; i += step) {
        const q = get(L, i);
        if (Number.isFinite(q)) v.push(q);
      }
      return quantiles(v, ps);
    };
    const lines = this.layers.filter((L) => L.y && L.x && L.fit !== false);
    const y = (L, i) => L.y[i];
    if (sp.y.log) {
      let lo = Infinity;
      let hi = -Infinity;
      for (const L of lines) {
        const [a, b, c] = sample(L, (l, i) => (l.y[i] > 0 ? l.y[i] : NaN), [0.01, 0.995, 1]);
        if (a < lo) lo = a;
        const top = this.full ? c : b;
        if (top > hi) hi = top;
      }
      for (const L of this.layers) if (L.kind === 'h') hi = Math.max(hi, L.v * 1.2);
      for (const L of this.layers)
        if (L.kind === 'hband') {
          hi = Math.max(hi, L.hi * 1.2);
          lo = this.full ? Math.min(lo, L.lo) : L.lo / 1.5;
        }
      if (!(hi > 0)) return [0.01, 10];
      return [Math.max(lo, hi / 1e6) / 1.3, hi * 1.9];
    }
    const q = this.full ? [0, 1] : [0.01, 0.99];
    const own = lines
      .filter((L) => !L.ref)
      .map((L) => sample(L, y, q))
      .filter((r) => r[0] === r[0]);
    const ref = lines
      .filter((L) => L.ref)
      .map((L) => sample(L, y, [0, 1]))
      .filter((r) => r[0] === r[0]);
    const bands = this.layers.filter((L) => L.kind === 'band' && L.s && L.fit !== false);
    let lo = Infinity;
    let hi = -Infinity;
    const add = (a, b) => {
      if (a < lo) lo = a;
      if (b > hi) hi = b;
    };
    ref.forEach((r) => add(...r));
    const base = ref.length
      ? [lo, hi]
      : sp.zero
        ? [0, 0]
        : own.length
          ? quantiles(
              own.map((r) => (r[0] + r[1]) / 2),
              [0.5, 0.5],
            )
          : [0, 0];
    const away = own.map((r) => Math.max(base[0] - r[0], r[1] - base[1], 0));
    const med = quantiles(away, [0.5])[0] || 0;
    const allow = this.full
      ? Infinity
      : Math.max(
          0.45 * (base[1] - base[0]),
          4 * (med || Math.min(...away.filter((v) => v > 0), Infinity)),
        );
    own.forEach((r) => {
      if (ref.length) add(Math.max(r[0], base[0] - allow), Math.min(r[1], base[1] + allow));
      else if (Math.max(base[0] - r[0], r[1] - base[1]) <= allow) add(...r);
    });
    if (sp.zero || this.full)
      for (const L of bands) {
        const [m] = sample(L, (l, i) => l.m * l.s[i], [this.full ? 1 : 0.6]);
        const mid = this.full && L.c ? sample(L, (l, i) => l.c[i], [0, 1]) : [0, 0];
        if (m <= (this.full ? Infinity : 2.5 * allow || Infinity)) add(mid[0] - m, mid[1] + m);
      }
    if (!(hi >= lo)) return [-1, 1];
    if (sp.zero) {
      const m = Math.max(-lo, hi) || 1;
      return [-m * 1.15, m * 1.15];
    }
    const pad = (hi - lo) * 0.1 || Math.abs(hi) * 0.05 || 1;
    return [lo - pad, hi + pad];
  }
  draw() {
    const w = this.el.clientWidth;
    const hh = this.el.clientHeight;
    if (!w || !hh) return;
    const start = performance.now();
    const dpr = window.devicePixelRatio || 1;
    for (const c of [this.base, this.over])
      if (c.width !== Math.round(w * dpr) || c.height !== Math.round(hh * dpr)) {
        c.width = Math.round(w * dpr);
        c.height = Math.round(hh * dpr);
      }
    const ctx = this.base.getContext('2d');
    ctx.setTransform(dpr, 0, 0, dpr, 0, 0);
    ctx.clearRect(0, 0, w, hh);
    this.dpr = dpr;
    this.paint(new CanvasSurface(ctx), w, hh);
    this.dirty = false;
    this.paintOver();
    this.ms = performance.now() - start;
    if (this.onPainted) this.onPainted();
  }
  paint(s, w, hh) {
    this.prepare(w, hh);
    const sp = this.spec;
    const {l, r, t, b} = this.f;
    const X = this.X;
    const Y = this.Y;
    const F = this.factor;
    if (sp.time && RUN)
      for (const seg of shaded())
        for (const [a, z] of seg.spans)
          if (z > page.x[0] && a < page.x[1]) {
            const x0 = Math.max(l, X.to(a));
            const x1 = Math.min(r, X.to(z));
            s.rect(x0, t, x1 - x0, b - t, {fill: colours.shade});
            if (sp.first && x1 - x0 > 8 + 6 * seg.name.length)
              s.text(seg.name, x0 + 4, b - 7, {size: 10, color: colours.faint});
          }
    const rows = sp.y.rows;
    if (rows)
      rows.forEach((name, i) => {
        s.text(
          name.length * 6.3 > l - 8 ? name.slice(0, Math.floor((l - 14) / 6.3)) + '…' : name,
          l - 8,
          Y.to(i),
          {
            align: 'right',
            color: NAMES.includes(name) ? colorOf(name) : colours.muted,
            weight: NAMES.includes(name) ? 600 : 400,
          },
        );
        s.path([l, Y.to(i + 0.5), r, Y.to(i + 0.5)], {stroke: colours.grid});
      });
    else
      for (const [v, label] of ticks(Y, F, Math.max(3, (b - t) / 32))) {
        const p = Math.round(Y.to(v)) + 0.5;
        if (p < t - 1 || p > b + 1) continue;
        s.path([l, p, r, p], {stroke: v === 0 && !sp.y.log ? colours.line : colours.grid});
        s.text(label, l - 7, p, {align: 'right'});
      }
    const xf = sp.time
      ? [1, 's']
      : unitFor(sp.x && sp.x.unit, Math.max(Math.abs(X.lo), Math.abs(X.hi)));
    if (sp.last !== false) {
      if (sp.x && sp.x.ticks)
        for (const [v, label] of sp.x.ticks) s.text(label, X.to(v), b + 11, {align: 'center'});
      else
        for (const [v, label] of ticks(
          sp.time ? {...X, lo: X.lo + T0, hi: X.hi + T0} : X,
          xf[0],
          (r - l) / 80,
        )) {
          const p = X.to(sp.time ? v - T0 : v);
          if (p < l - 1 || p > r + 1) continue;
          s.path([Math.round(p) + 0.5, t, Math.round(p) + 0.5, b], {stroke: colours.grid});
          s.text(label, p, b + 11, {align: 'center'});
        }
      const xl = sp.time
        ? 'time [s]'
        : sp.x && sp.x.label && sp.x.label + (xf[1] ? ` [${xf[1]}]` : '');
      if (xl) s.text(xl, r, b + 26, {align: 'right', size: 11});
    } else if (sp.time)
      for (const [v] of ticks({...X, lo: X.lo + T0, hi: X.hi + T0}, 1, (r - l) / 80)) {
        const p = Math.round(X.to(v - T0)) + 0.5;
        s.path([p, t, p, b], {stroke: colours.grid});
      }
    s.clip(l, t, r - l, b - t);
    const width = r - l;
    const lost = new Set();
    for (const L of this.layers) this.layer(s, L, width, lost);
    s.unclip();
    if (sp.time && RUN)
      for (const [name, [at]] of eventsNear())
        if (at !== null && at >= page.x[0] && at <= page.x[1])
          s.rect(X.to(at) - 1, t, 2, 6, {fill: colorOf(name), alpha: dim(name)});
    s.path([l, b + 0.5, r, b + 0.5], {stroke: colours.line});
    if (sp.label)
      s.text(sp.label + (this.unit ? ` [${this.unit}]` : ''), l, 8, {
        weight: 600,
        size: 12,
        color: colours.ink,
      });
    this.lost = lost;
  }
  layer(s, L, width, lost) {
    const {l, r, t, b} = this.f;
    const X = this.X;
    const Y = this.Y;
    const color = colourOfLayer(L);
    const a = dim(L.est) * (L.alpha === undefined ? 1 : L.alpha);
    const time = this.spec.time;
    if (L.kind === 'h') {
      const y = Y.to(L.v);
      s.path([l, y, r, y], {stroke: color, dash: L.dash || [5, 4], width: 1.2, alpha: a});
      if (L.text)
        s.text(L.text, r - 4, y > t + 14 ? y - 7 : y + 8, {
          align: 'right',
          size: 10.5,
          color,
          halo: true,
        });
      return;
    }
    if (L.kind === 'v') {
      const x = X.to(L.v);
      s.path([x, t, x, b], {stroke: color, dash: L.dash || [4, 4], alpha: a});
      return;
    }
    if (L.kind === 'hband') {
      const y0 = clamp(Y.to(L.hi), t, b);
      const y1 = clamp(Y.to(L.lo), t, b);
      s.rect(l, y0, width, y1 - y0, {
        fill: L.color ? color : colours.shade,
        alpha: L.alpha === undefined ? 1 : L.alpha,
      });
      return;
    }
    if (L.kind === 'custom') {
      L.paint(s, X, Y, this);
      return;
    }
    if (L.kind === 'bars') {
      L.y.forEach((v, i) => {
        const x0 = X.to(L.x[i]);
        const x1 = X.to(L.x2[i]);
        s.rect(
          x0,
          Y.to(Math.max(v, L.from || 0)),
          Math.max(1, x1 - x0 - 1),
          Math.abs(Y.to(L.from || 0) - Y.to(v)),
          {fill: color, alpha: a},
        );
      });
      return;
    }
    const i0 = time ? Math.max(0, lower(L.x, X.lo) - 1) : 0;
    const i1 = time ? Math.min(L.x.length, lower(L.x, X.hi) + 1) : L.x.length;
    if (L.kind === 'band') {
      for (const piece of outline(L, i0, i1, X, Y, width)) {
        s.path(piece, {fill: color, alpha: a * (L.fill || 0.14)});
        if (L.edge) {
          const n = piece.length / 2;
          s.path(piece.slice(0, n), {stroke: color, width: 0.9, alpha: 0.55 * a});
          s.path(piece.slice(n), {stroke: color, width: 0.9, alpha: 0.55 * a});
        }
      }
      return;
    }
    if (L.kind === 'line') {
      const pts = L.step ? steps(L, X, Y) : trace(L.x, L.y, i0, i1, X, Y, width, L.gap);
      s.path(pts, {
        stroke: color,
        width: (L.width || 1.5) * (page.focus === L.est && L.est ? 1.6 : 1),
        dash: L.dash || (L.est ? dashOf(L.est) : []),
        alpha: a,
      });
      if (time && L.est) {
        let out = 0;
        for (let i = 1; i < pts.length; i += 2)
          if (pts[i] < t - 1 || (pts[i] > b + 1 && !this.spec.y.log)) out++;
        if (out > 2) lost.add(L.est);
      }
      return;
    }
    if (L.kind === 'dots') {
      // A dense cloud is drawn as the pixels that it covers, which is the same picture. L.keep:
      // every mark is drawn.
      const dense = !L.keep && i1 - i0 > 4000;
      const H = Math.ceil(b - t) + 2;
      const W = Math.ceil(width) + 2;
      const cells = dense ? new Uint8Array(W * H) : null;
      const pts = [];
      for (let i = i0; i < i1; i++) {
        if (L.only && !L.only(i)) continue;
        const x = X.to(L.x[i]);
        let y = Y.to(L.y[i]);
        if (y !== y || x < l - 3 || x > r + 3) continue;
        if (L.keep) y = clamp(y, t + 4, b - 4);
        else if (y < t || y > b) continue;
        if (dense) cells[Math.max(0, (x - l) | 0) * H + ((y - t) | 0)] = 1;
        else pts.push(x, y);
      }
      if (dense) s.runs(cells, W, H, l, t, {fill: color, alpha: a});
      else
        s.marks(
          pts,
          L.shape || 'dot',
          L.size || 2,
          L.shape === 'cross' || L.shape === 'plus'
            ? {stroke: color, alpha: a, width: L.width}
            : {fill: color, alpha: a},
        );
    }
  }
  paintOver() {
    const ctx = this.over.getContext('2d');
    const {l, r, t, b} = this.f || {};
    const sp = this.spec;
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, this.over.width, this.over.height);
    if (!this.f) return;
    ctx.setTransform(this.dpr, 0, 0, this.dpr, 0, 0);
    if (sp.time) {
      if (this.drag && Math.abs(this.drag[1] - this.drag[0]) > 3) {
        ctx.fillStyle = colours.accent;
        ctx.globalAlpha = 0.18;
        ctx.fillRect(Math.min(...this.drag), t, Math.abs(this.drag[1] - this.drag[0]), b - t);
        ctx.globalAlpha = 1;
      }
      const at = page.cursor === null ? page.time : page.cursor;
      if (at !== null && at >= page.x[0] && at <= page.x[1]) {
        const x = Math.round(this.X.to(at)) + 0.5;
        ctx.strokeStyle = colours.muted;
        ctx.lineWidth = 1;
        ctx.beginPath();
        ctx.moveTo(x, t);
        ctx.lineTo(x, b);
        ctx.stroke();
        for (const L of this.layers)
          if (L.kind === 'line' && L.name) {
            const y = this.Y.to(L.y[nearest(L.x, at)]);
            if (y >= t && y <= b) {
              ctx.fillStyle = colourOfLayer(L);
              ctx.beginPath();
              ctx.arc(this.X.to(L.x[nearest(L.x, at)]), y, 3, 0, 7);
              ctx.fill();
            }
          }
      }
    } else if (this.hit) {
      ctx.strokeStyle = colours.ink;
      ctx.lineWidth = 1.5;
      ctx.beginPath();
      ctx.arc(this.hit[0], this.hit[1], 6, 0, 7);
      ctx.stroke();
    }
  }
  readout(at) {
    const rows = [];
    const ev = eventsNear(at, ((page.x[1] - page.x[0]) * 5) / (this.f.r - this.f.l)).slice(0, 3);
    for (const L of this.layers) {
      if (!L.name || !L.x || !L.x.length || (L.kind !== 'line' && L.kind !== 'dots')) continue;
      const i = nearest(L.x, at);
      const gap = Math.abs(this.X.to(L.x[i]) - this.X.to(at));
      if (gap > 12 || L.y[i] !== L.y[i] || (L.only && !L.only(i))) continue;
      rows.push(
        element(
          'tr',
          {},
          element('td', {class: 'name', style: `color: ${colourOfLayer(L)}`}, L.name),
          element(
            'td',
            {},
            numberText(L.y[i] * this.factor) +
              (L.s ? ' ± ' + numberText(3 * L.s[i] * this.factor, 2) : '') +
              (this.unit ? ' ' + this.unit : ''),
          ),
        ),
      );
    }
    const hasSigma = this.layers.some((L) => L.s && L.name);
    return [
      element('b', {}, 't = ' + clock(at) + ' s'),
      rows.length ? element('table', {}, rows) : null,
      hasSigma ? element('span', {class: 'quiet'}, '± is 3σ') : null,
      ev.map(([n, v]) =>
        element('p', {class: 'event'}, nameOf(n), ` ${v[1].replace(/_/g, ' ')}: ${v[2]}`),
      ),
    ];
  }
  pointer() {
    const o = this.over;
    const sp = this.spec;
    const X = (e) => e.clientX - o.getBoundingClientRect().left;
    o.addEventListener('pointerleave', () => {
      hideTip();
      this.hit = null;
      if (sp.time) {
        page.cursor = null;
        cursorMoved();
      } else if (this.f) this.paintOver();
    });
    if (!sp.time) {
      o.addEventListener('pointermove', (e) => {
        if (this.f) this.hover(e);
      });
      o.addEventListener('click', (e) => {
        if (this.f && this.hover(e) && this.hitLayer.pick) this.hitLayer.pick(this.hitIndex);
      });
      return;
    }
    o.addEventListener('pointerdown', (e) => {
      if (e.pointerType !== 'mouse' || e.button) return;
      o.setPointerCapture(e.pointerId);
      this.drag = [X(e), X(e)];
      this.pan = e.shiftKey ? page.x.slice() : null;
    });
    o.addEventListener('pointermove', (e) => {
      if (!this.f) return;
      page.cursor = clamp(this.X.from(X(e)), page.x[0], page.x[1]);
      if (this.drag) {
        this.drag[1] = X(e);
        if (this.pan) {
          const d =
            ((this.drag[0] - this.drag[1]) / (this.f.r - this.f.l)) * (this.pan[1] - this.pan[0]);
          zoomTo(this.pan[0] + d, this.pan[1] + d);
        }
      }
      cursorMoved();
      showTip(e, this.readout(page.cursor));
    });
    o.addEventListener('pointerup', (e) => {
      const d = this.drag;
      this.drag = null;
      if (!d || !this.f) return;
      if (this.pan) {
        this.pan = null;
        return;
      }
      if (Math.abs(d[1] - d[0]) > 4)
        zoomTo(
          this.X.from(clamp(Math.min(...d), this.f.l, this.f.r)),
          this.X.from(clamp(Math.max(...d), this.f.l, this.f.r)),
        );
      else {
        const at = this.X.from(X(e));
        const near = eventsNear(at, ((page.x[1] - page.x[0]) * 5) / (this.f.r - this.f.l));
        page.time = near.length ? near[0][1][0] : at;
        redraw();
      }
    });
    o.addEventListener('dblclick', () => zoomTo(...page.full));
    o.addEventListener(
      'wheel',
      (e) => {
        if (!e.ctrlKey && !e.metaKey && !e.shiftKey) return;
        e.preventDefault();
        zoomBy(Math.exp((e.deltaY || e.deltaX) * 0.002), this.X.from(X(e)));
      },
      {passive: false},
    );
    o.addEventListener('keydown', (e) => timeKey(e));
  }
  hover(e) {
    const box = this.over.getBoundingClientRect();
    const mx = e.clientX - box.left;
    const my = e.clientY - box.top;
    let best = 14 * 14;
    this.hit = null;
    for (const L of this.layers)
      if (L.kind === 'dots' && L.tip)
        for (let i = 0; i < L.x.length; i++) {
          const x = this.X.to(L.x[i]);
          const y = this.Y.to(L.y[i]);
          const d = (x - mx) ** 2 + (y - my) ** 2;
          if (d < best) {
            best = d;
            this.hit = [x, y];
            this.hitLayer = L;
            this.hitIndex = i;
          }
        }
    this.paintOver();
    if (this.hit) showTip(e, this.hitLayer.tip(this.hitIndex));
    else hideTip();
    return this.hit;
  }
  csv() {
    const rows = [];
    for (const L of this.layers || [])
      if (L.x && L.y && L.kind !== 'custom') {
        const name =
          L.est && L.name && L.est !== L.name ? L.est + ' ' + L.name : L.name || L.est || L.k;
        const quoted = (text) => `"${text.replace(/"/g, '""')}"`;
        const start = [quoted(this.spec.label || ''), quoted(name)];
        for (let i = 0; i < L.x.length; i++) {
          if (L.only && !L.only(i)) continue;
          const x = L.x[i] + (this.spec.time ? T0 : 0);
          const y = Number.isNaN(L.y[i]) ? '' : L.y[i];
          rows.push([...start, x, y, L.s ? L.s[i] : ''].join(','));
        }
      }
    return rows;
  }
}

function timeKey(e) {
  const t =
    page.cursor === null
      ? page.time === null
        ? (page.x[0] + page.x[1]) / 2
        : page.time
      : page.cursor;
  const w = page.x[1] - page.x[0];
  const step = {ArrowLeft: -1, ArrowRight: 1}[e.key];
  if (step && e.shiftKey) zoomTo(page.x[0] + step * w * 0.2, page.x[1] + step * w * 0.2);
  else if (step) {
    page.time = clamp(t + (step * w) / 200, ...page.x);
    page.cursor = null;
    redraw();
  } else if (e.key === '+' || e.key === '=') zoomBy(0.6, t);
  else if (e.key === '-') zoomBy(1 / 0.6, t);
  else if (e.key === '0' || e.key === 'Escape') zoomTo(...page.full);
  else return;
  e.preventDefault();
}

function dispose(ps) {
  for (const p of ps) {
    plots.delete(p);
    observer.unobserve(p.el);
    resizer.unobserve(p.el);
  }
}
