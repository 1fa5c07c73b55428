// SPDX-License-Identifier: Apache-2.0
// Map: trajectories and landmarks in parallel projection, from above or from any side.

const RAMP = [
  [31, 111, 180],
  [106, 160, 200],
  [185, 180, 168],
  [232, 160, 76],
  [209, 68, 12],
];

function ramp(u) {
  const p = clamp(u, 0, 1) * 4;
  const i = Math.min(3, Math.floor(p));
  const f = p - i;
  return `rgb(${RAMP[i].map((v, k) => Math.round(v + f * (RAMP[i + 1][k] - v))).join(',')})`;
}

class MapView {
  constructor(first) {
    this.tracks = RUN.estimators
      .filter((e) => e.position)
      .map((e) => {
        const b = e.blocks.find((k) => k.name === e.position);
        const v = b.value.map(columnOf);
        const n = v[0].length;
        const q =
          e.orientation && e.blocks.find((k) => k.name === e.orientation).value.map(columnOf);
        return {
          e,
          name: e.name,
          t: columnOf(e.t),
          p: [v[0], v[1], v[2] || new Float32Array(n)],
          s: b.sigma.map(columnOf),
          c: (e.position_cov || []).map(columnOf),
          err: b.error.map(columnOf),
          q,
          b,
        };
      });
    const b = this.tracks[0].b;
    const tr = b.elements.map((k) => truthOf(b, k));
    this.truth = tr[0]
      ? {t: columnOf(RUN.t), p: [tr[0], tr[1], tr[2] || new Float32Array(tr[0].length)]}
      : null;
    this.marks = this.tracks
      .filter((k) => k.e.landmarks)
      .map((k) => ({
        name: k.name,
        ...Object.fromEntries(Object.entries(k.e.landmarks).map(([a, v]) => [a, columnOf(v)])),
      }));
    this.spec = {
      label: '',
      name: first ? 'three-dimensional view' : 'top view of trajectory and landmarks',
      height: 470,
      y: {},
    };
    this.options = first
      ? first.options
      : {
          paintBy: this.tracks.length > 1 ? 'estimator' : this.truth ? 'error' : 'sigma',
          ellipses: true,
        };
    this.base = element('canvas', {class: 'base', 'aria-hidden': 'true'});
    this.over = element('canvas', {
      class: 'over',
      tabindex: 0,
      role: 'img',
      'aria-label': 'Map. Arrow keys turn or move it, plus and minus zoom, 0 fits it.',
    });
    this.el = element(
      'div',
      {class: 'plot map', style: `height:${Math.min(470, Math.max(330, innerWidth * 0.8))}px`},
      this.base,
      this.over,
    );
    this.el.plot = this;
    this.dirty = true;
    plots.add(this);
    observer.observe(this.el);
    resizer.observe(this.el);
    this.fitPlane();
    this.view(first ? '3d' : 'top');
    this.pointer();
    if (first) return;
    this.slider = element('input', {
      type: 'range',
      min: 0,
      max: 1000,
      value: 1000,
      'aria-label': 'time',
      oninput: (e) => {
        page.cursor = null;
        page.time = page.full[0] + (e.target.value / 1000) * (page.full[1] - page.full[0]);
        redraw();
      },
    });
    this.clock = element('span', {}, '');
    this.extra = [
      element(
        'div',
        {class: 'slider'},
        element('button', {class: 'btn small', onclick: (e) => this.play(e.target)}, '▶ play'),
        this.slider,
        this.clock,
      ),
    ];
    this.controls = this.buttons();
  }
  fitPlane() {
    const T = this.truth || this.tracks[0];
    const path = [];
    const pts = [];
    const step = Math.max(1, Math.floor(T.t.length / 600));
    for (let i = 0; i < T.t.length; i += step) {
      const p = T.p.map((c) => c[i]);
      if (p.every(Number.isFinite)) path.push(p);
    }
    for (const m of this.marks.slice(0, 1))
      for (let i = 0; i < m.x.length; i++) {
        const p = m.tx[i] === m.tx[i] ? [m.tx[i], m.ty[i], m.tz[i]] : [m.x[i], m.y[i], m.z[i]];
        if (p.every(Number.isFinite)) pts.push(p);
      }
    let E = cloud(path);
    this.fitted = 'the plane of the path';
    if (E.values[1] < 0.02 * E.values[0] && pts.length > 3) {
      E = cloud(path.concat(pts));
      this.fitted = 'the plane of path and landmarks';
    }
    const axisOf = (v) => [0, 1, 2].reduce((m, k) => (Math.abs(v[k]) > Math.abs(v[m]) ? k : m), 0);
    const [u, , nn] = E.rows;
    const sign = (v) => {
      const k = axisOf(v);
      return v[k] < 0 ? v.map((c) => -c) : v;
    };
    const n = sign(nn);
    const right = sign(u);
    this.planeBasis = [right, cross3(n, right), n];
    this.all = path.concat(pts);
    const q = [0, 1, 2].map((k) =>
      quantiles(
        this.all.map((p) => p[k]),
        [0.02, 0.98],
      ),
    );
    this.centre = q.map(([a, b]) => (a + b) / 2);
  }
  view(mode) {
    this.mode = mode;
    const [r, u, n] = this.planeBasis;
    const tilt = (a, b, ang) => a.map((v, k) => v * Math.cos(ang) + b[k] * Math.sin(ang));
    if (mode === 'top') this.R = [r, u, n];
    else if (mode === 'side') this.R = [r, n, u.map((v) => -v)];
    else {
      const r2 = tilt(r, u, -0.6);
      const f = tilt(
        cross3(n, r2).map((v) => -v),
        n,
        0.55,
      );
      this.R = [r2, cross3(f, r2), f];
    }
    this.k = 0;
    this.dirty = true;
    redraw();
  }
  project(p) {
    const d = [p[0] - this.centre[0], p[1] - this.centre[1], p[2] - this.centre[2]];
    return [this.w / 2 + this.k * dot3(this.R[0], d), this.hh / 2 - this.k * dot3(this.R[1], d)];
  }
  frame() {
    // fit all points
    const a = this.all.map((p) => [dot3(this.R[0], p), dot3(this.R[1], p)]);
    const cut = this.truth ? [0, 1] : [0.005, 0.995];
    const qx = quantiles(
      a.map((p) => p[0]),
      cut,
    );
    const qy = quantiles(
      a.map((p) => p[1]),
      cut,
    );
    const mid = [(qx[0] + qx[1]) / 2, (qy[0] + qy[1]) / 2];
    const d3 = dot3(this.R[2], this.centre);
    this.centre = [0, 1, 2].map(
      (k) => mid[0] * this.R[0][k] + mid[1] * this.R[1][k] + d3 * this.R[2][k],
    );
    this.k =
      0.88 *
      Math.min(
        (this.w - 30) / Math.max(qx[1] - qx[0], 1e-9),
        (this.hh - 60) / Math.max(qy[1] - qy[0], 1e-9),
      );
  }
  now() {
    return page.cursor !== null ? page.cursor : page.time !== null ? page.time : page.full[1];
  }
  draw() {
    Plot.prototype.draw.call(this);
  }
  value(T, i) {
    if (this.options.paintBy === 'time') return T.t[i];
    const c = this.options.paintBy === 'error' ? T.err : T.s;
    return c.length ? Math.sqrt(sum(c.map((a) => a[i] * a[i]))) : NaN;
  }
  ellipse(C) {
    // outline of 3 sigma, projected: exact, as the projection is parallel
    const M = [this.R[0], this.R[1]];
    const P = M.map((a) =>
      M.map((b) => {
        let s = 0;
        for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) s += a[i] * C[i][j] * b[j];
        return s;
      }),
    );
    const m = (P[0][0] + P[1][1]) / 2;
    const d = Math.hypot((P[0][0] - P[1][1]) / 2, P[0][1]);
    const th = 0.5 * Math.atan2(2 * P[0][1], P[0][0] - P[1][1]);
    return [
      3 * this.k * Math.sqrt(Math.max(0, m + d)),
      3 * this.k * Math.sqrt(Math.max(0, m - d)),
      th,
    ];
  }
  drawEllipse(s, at, C, o) {
    const [a, b, th] = this.ellipse(C);
    const pts = [];
    if (!(a > 0.7) || a > 4000) return;
    for (let i = 0; i <= 40; i++) {
      const x = a * Math.cos((i * Math.PI) / 20);
      const y = b * Math.sin((i * Math.PI) / 20);
      pts.push(
        at[0] + x * Math.cos(th) - y * Math.sin(th),
        at[1] - x * Math.sin(th) - y * Math.cos(th),
      );
    }
    s.path(pts, o);
  }
  covAt(T, i) {
    const [x, y, z] = T.s.map((c) => c[i] * c[i]);
    const c = T.c;
    return [
      [x, c[0] ? c[0][i] : 0, c[1] ? c[1][i] : 0],
      [c[0] ? c[0][i] : 0, y, c[2] ? c[2][i] : 0],
      [c[1] ? c[1][i] : 0, c[2] ? c[2][i] : 0, z || 0],
    ];
  }
  paint(s, w, hh) {
    this.w = w;
    this.hh = hh;
    this.f = {l: 0, r: w, t: 0, b: hh};
    if (!(this.k > 0)) this.frame();
    const now = this.now();
    const tracks = this.tracks.filter((T) => shown(T.name));
    this.spots = [];
    if (this.mode !== 'side') this.floor(s);
    // landmarks
    for (const m of this.marks.filter((q) => shown(q.name))) {
      const color = colorOf(m.name);
      const a = dim(m.name);
      const dots = [];
      const gone = [];
      const truths = [];
      const lines = [];
      for (let i = 0; i < m.x.length; i++) {
        if (m.first_s[i] > now + 1e-9) continue;
        const p = this.project([m.x[i], m.y[i], m.z[i]]);
        const removed = m.removed_s[i] <= now;
        if (
          !Number.isFinite(p[0]) ||
          p[0] < -200 ||
          p[0] > w + 200 ||
          p[1] < -200 ||
          p[1] > hh + 200
        )
          continue;
        (removed ? gone : dots).push(...p);
        this.spots.push({p, m, i});
        if (!removed && this.options.ellipses)
          this.drawEllipse(
            s,
            p,
            [
              [m.sx[i] ** 2, m.cxy[i], m.cxz[i]],
              [m.cxy[i], m.sy[i] ** 2, m.cyz[i]],
              [m.cxz[i], m.cyz[i], m.sz[i] ** 2],
            ],
            {fill: color, alpha: 0.16 * a},
          );
        if (m.tx[i] === m.tx[i]) {
          const q = this.project([m.tx[i], m.ty[i], m.tz[i]]);
          truths.push(...q);
          if (!removed) lines.push(...p, ...q, NaN, NaN);
        }
      }
      s.path(lines, {stroke: color, width: 1, alpha: 0.6 * a});
      s.marks(truths, 'plus', 3.5, {stroke: colours.muted, width: 1.2, alpha: 0.9});
      s.marks(gone, 'dot', 1.6, {fill: colours.faint, alpha: 0.5});
      s.marks(dots, 'dot', 2.3, {fill: color, alpha: a});
    }
    // paths
    const lineOf = (T, i0, i1) => {
      const out = [];
      const step = Math.max(1, Math.floor((i1 - i0) / 3000));
      for (let i = i0; i <= i1; i += i + step > i1 && i < i1 ? i1 - i : step) {
        const p = this.project([T.p[0][i], T.p[1][i], T.p[2][i]]);
        out.push(p[0], Number.isFinite(p[0]) ? p[1] : NaN);
      }
      return out;
    };
    if (this.truth)
      s.path(lineOf(this.truth, 0, this.truth.t.length - 1), {
        stroke: colours.ink,
        width: 1.3,
        dash: [5, 3],
        alpha: 0.75,
      });
    let range = null;
    if (this.options.paintBy !== 'estimator') {
      const v = [];
      for (const T of tracks)
        for (let i = 0, d = Math.max(1, Math.floor(T.t.length / 500)); i < T.t.length; i += d)
          v.push(this.value(T, i));
      range = quantiles(v, [0.02, 0.98]);
      if (!(range[1] > range[0])) range = [0, range[1] || 1];
    }
    for (const T of tracks) {
      const a = dim(T.name);
      const end = nearest(T.t, now);
      const color = colorOf(T.name);
      const n = T.t.length - 1;
      if (!T.t.length) continue;
      if (this.options.ellipses && T.s.length)
        for (let j = 0; j <= 24; j++) {
          const i = Math.round((j * n) / 24);
          if (i <= end)
            this.drawEllipse(s, this.project(T.p.map((c) => c[i])), this.covAt(T, i), {
              stroke: color,
              width: 0.8,
              alpha: 0.45 * a,
            });
        }
      if (end < n) s.path(lineOf(T, end, n), {stroke: color, width: 1, alpha: 0.25 * a});
      if (!range)
        s.path(lineOf(T, 0, end), {stroke: color, width: 2.2, dash: dashOf(T.name), alpha: a});
      else {
        const step = Math.max(1, Math.floor(end / 700));
        for (let i = 0; i < end; i += step) {
          const j = Math.min(i + step, end);
          const p = this.project(T.p.map((c) => c[i]));
          const q = this.project(T.p.map((c) => c[j]));
          s.path([...p, ...q], {
            stroke: ramp((this.value(T, j) - range[0]) / (range[1] - range[0])),
            width: 3,
            alpha: a,
          });
        }
      }
      const here = this.project(T.p.map((c) => c[end]));
      const first = this.project(T.p.map((c) => c[0]));
      s.marks(first, 'dot', 4, {stroke: color, fill: colours.panel, width: 2, alpha: a});
      this.rays(s, T, T.t[end], here);
      if (T.s.length)
        this.drawEllipse(s, here, this.covAt(T, end), {
          stroke: color,
          fill: color,
          alpha: 0.22 * a,
          width: 1.2,
        });
      this.triad(s, T, end, here);
      s.marks(here, 'square', 3.5, {fill: color, alpha: a});
    }
    this.furniture(s, range);
    if (this.slider && !(s instanceof SvgSurface)) {
      this.slider.value = Math.round((1000 * (now - page.full[0])) / (page.full[1] - page.full[0]));
      this.clock.textContent = clock(now) + ' s';
    }
  }
  rays(s, T, t, here) {
    // what it sees now
    const m = this.marks.find((q) => q.name === T.name);
    if (!m) return;
    const place = new Map(Array.from(m.id, (id, i) => [id, i]));
    const good = [];
    const bad = [];
    for (const I of T.e.innovations)
      if (I.landmark !== undefined) {
        const ti = columnOf(I.t);
        const ids = columnOf(I.landmark);
        const out = columnOf(I.outcome);
        for (let i = lower(ti, t - 1e-9); i < ti.length && ti[i] <= t + 1e-9; i++) {
          const k = place.get(ids[i]);
          if (k === undefined) continue;
          (isUsed(out[i]) ? good : bad).push(
            ...here,
            ...this.project([m.x[k], m.y[k], m.z[k]]),
            NaN,
            NaN,
          );
        }
      }
    s.path(good, {stroke: colorOf(T.name), width: 0.8, alpha: 0.35 * dim(T.name)});
    s.path(bad, {stroke: REJECTED(), width: 1.4, alpha: 0.9 * dim(T.name)});
  }
  triad(s, T, i, here) {
    if (!T.q) return;
    const [w, x, y, z] = T.q.map((c) => c[i]);
    const L = (0.07 * Math.min(this.w, this.hh)) / this.k;
    const P = T.p.map((c) => c[i]);
    const axes = [
      [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
      [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
      [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ];
    axes.forEach((a, k) => {
      const e = this.project(P.map((v, j) => v + L * a[j]));
      s.path([...here, ...e], {stroke: colours.ink, width: 1.4, alpha: dim(T.name)});
      if (Math.hypot(e[0] - here[0], e[1] - here[1]) > 12)
        s.text('xyz'[k], e[0] + 4, e[1], {size: 10, color: colours.ink, halo: true});
    });
  }
  floor(s) {
    // a grid in the fitted plane
    const [u, v] = this.planeBasis;
    const span = Math.max(this.w, this.hh) / this.k;
    const step = niceStep(span / 9);
    const n = this.mode === 'top' ? 12 : 7;
    const lines = [];
    const c = this.planeBasis.map((b) => dot3(b, this.centre));
    const a0 = Math.round(c[0] / step) * step;
    const b0 = Math.round(c[1] / step) * step;
    const at = (a, b) =>
      this.project([0, 1, 2].map((k) => a * u[k] + b * v[k] + c[2] * this.planeBasis[2][k]));
    for (let i = -n; i <= n; i++)
      lines.push(
        ...at(a0 + i * step, b0 - n * step),
        ...at(a0 + i * step, b0 + n * step),
        NaN,
        NaN,
        ...at(a0 - n * step, b0 + i * step),
        ...at(a0 + n * step, b0 + i * step),
        NaN,
        NaN,
      );
    s.path(lines, {stroke: colours.grid});
  }
  furniture(s, range) {
    const step = niceStep(110 / this.k);
    const L = step * this.k;
    const y = this.hh - 16;
    const [f, unit] = unitFor('m', step);
    s.path([16, y - 4, 16, y, 16 + L, y, 16 + L, y - 4], {stroke: colours.ink, width: 1.5});
    s.text(+(step * f).toPrecision(3) + ' ' + unit, 16 + L / 2, y - 9, {
      align: 'center',
      color: colours.ink,
      halo: true,
    });
    const o = [34, this.hh - 70];
    [0, 1, 2].forEach((k) => {
      const e = [o[0] + 22 * this.R[0][k], o[1] - 22 * this.R[1][k]];
      s.path([...o, ...e], {stroke: colours.muted, width: 1.2});
      if (Math.hypot(e[0] - o[0], e[1] - o[1]) > 5)
        s.text('xyz'[k], o[0] + 29 * this.R[0][k], o[1] - 29 * this.R[1][k], {
          align: 'center',
          size: 10.5,
          color: colours.muted,
        });
    });
    if (!range) return;
    const x0 = this.w - 196;
    const names = {error: 'position error', sigma: 'position σ', time: 'time'};
    const name = names[this.options.paintBy];
    const [g, u] = unitFor(this.options.paintBy === 'time' ? 's' : 'm', range[1]);
    for (let i = 0; i < 60; i++) s.rect(x0 + i * 3, this.hh - 24, 3.2, 8, {fill: ramp(i / 59)});
    s.text(`${name} [${u}]`, x0, this.hh - 33, {color: colours.ink, halo: true});
    s.text(numberText(range[0] * g), x0, this.hh - 8, {size: 10.5});
    s.text(numberText(range[1] * g), x0 + 180, this.hh - 8, {size: 10.5, align: 'right'});
  }
  paintOver() {
    if (this.seen && this.lastNow !== this.now()) {
      this.lastNow = this.now();
      this.dirty = true;
      requestAnimationFrame(() => {
        if (this.dirty && this.seen) {
          const ctx = this.base.getContext('2d');
          ctx.setTransform(this.dpr, 0, 0, this.dpr, 0, 0);
          ctx.clearRect(0, 0, this.w, this.hh);
          this.paint(new CanvasSurface(ctx), this.w, this.hh);
          this.dirty = false;
        }
      });
    }
  }
  turn(dx, dy) {
    const rot = (a, b, t) => [
      a.map((v, k) => v * Math.cos(t) + b[k] * Math.sin(t)),
      b.map((v, k) => v * Math.cos(t) - a[k] * Math.sin(t)),
    ];
    let [r, u, f] = this.R;
    [r, f] = rot(r, f, dx);
    [u, f] = rot(u, f, -dy);
    r = cross3(u, f);
    this.R = [r, u, f];
    this.mode = '3d';
  }
  move(dx, dy) {
    this.centre = this.centre.map((v, k) => v - (dx * this.R[0][k] - dy * this.R[1][k]) / this.k);
  }
  scaleBy(f) {
    this.k *= f;
    redraw();
  }
  both(f) {
    for (const p of plots) if (p instanceof MapView) p.scaleBy(f);
  }
  pointer() {
    const o = this.over;
    let last = null;
    let active = false;
    o.addEventListener('pointerdown', (e) => {
      last = [e.clientX, e.clientY];
      active = true;
      o.setPointerCapture(e.pointerId);
    });
    o.addEventListener('pointerup', () => {
      last = null;
    });
    o.addEventListener('pointerleave', () => {
      hideTip();
      if (!last) active = false;
    });
    o.addEventListener('pointermove', (e) => {
      if (last) {
        const dx = e.clientX - last[0];
        const dy = e.clientY - last[1];
        last = [e.clientX, e.clientY];
        if (this.mode !== '3d' || e.shiftKey || e.buttons === 2) this.move(dx, dy);
        else this.turn(-dx * 0.008, -dy * 0.008);
        redraw();
        hideTip();
        return;
      }
      const box = o.getBoundingClientRect();
      const mx = e.clientX - box.left;
      const my = e.clientY - box.top;
      let best = 100;
      let hit = null;
      for (const q of this.spots || []) {
        const d = (q.p[0] - mx) ** 2 + (q.p[1] - my) ** 2;
        if (d < best) {
          best = d;
          hit = q;
        }
      }
      if (hit) showTip(e, landmarkTip(hit.m, hit.i));
      else hideTip();
    });
    o.addEventListener(
      'wheel',
      (e) => {
        if (!active && !e.ctrlKey) return;
        e.preventDefault();
        this.scaleBy(Math.exp(-e.deltaY * 0.0015));
      },
      {passive: false},
    );
    o.addEventListener('contextmenu', (e) => e.preventDefault());
    o.addEventListener('keydown', (e) => {
      const d = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[
        e.key
      ];
      if (d) {
        if (this.mode === '3d') this.turn(d[0] * 0.1, d[1] * 0.1);
        else this.move(-d[0] * 30, -d[1] * 30);
      } else if (e.key === '+') this.k *= 1.2;
      else if (e.key === '-') this.k /= 1.2;
      else if (e.key === '0') this.k = 0;
      else return;
      e.preventDefault();
      redraw();
    });
  }
  buttons() {
    const modes = choice(
      'view',
      [
        ['top', 'top'],
        ['side', 'side'],
      ],
      'top',
      (v) => this.view(v),
    );
    const colours = choice(
      'colour',
      [
        ['estimator', 'estimator'],
        this.truth && ['error', 'error'],
        ['sigma', 'σ'],
        ['time', 'time'],
      ].filter(Boolean),
      this.options.paintBy,
      (v) => {
        this.options.paintBy = v;
        redraw();
      },
    );
    const small = (label, title, f) =>
      element('button', {class: 'btn small', title, 'aria-label': title, onclick: f}, label);
    return [
      modes,
      colours,
      element(
        'span',
        {class: 'group'},
        small('+', 'zoom in', () => this.both(1.3)),
        small('−', 'zoom out', () => this.both(1 / 1.3)),
        small('fit', 'fit all', () => this.both(0)),
        element(
          'button',
          {
            class: 'btn small',
            'aria-pressed': 'true',
            onclick: (e) => {
              this.options.ellipses = !this.options.ellipses;
              e.target.setAttribute('aria-pressed', this.options.ellipses);
              redraw();
            },
          },
          '3σ ellipses',
        ),
      ),
    ];
  }
  play(button) {
    if (this.timer) {
      clearInterval(this.timer);
      this.timer = 0;
      button.textContent = '▶ play';
      return;
    }
    button.textContent = '❚❚ stop';
    page.cursor = null;
    if (page.time === null || page.time >= page.full[1]) page.time = page.full[0];
    this.timer = setInterval(() => {
      page.time += (page.full[1] - page.full[0]) / 300;
      if (page.time >= page.full[1]) {
        page.time = page.full[1];
        this.play(button);
      }
      cursorMoved();
    }, 33);
  }
  csv() {
    return this.tracks.flatMap((T) =>
      Array.from(T.t, (t, i) => `"map","${T.name}",${t + T0},"${T.p.map((c) => c[i]).join(' ')}",`),
    );
  }
}

function landmarkTip(m, i) {
  const e = Math.hypot(m.x[i] - m.tx[i], m.y[i] - m.ty[i], m.z[i] - m.tz[i]);
  const s = Math.hypot(m.sx[i], m.sy[i], m.sz[i]);
  return [
    element('b', {}, `landmark ${m.id[i]}`),
    `${m.name}: σ ${withUnit(s, 'm')}`,
    e === e ? `, error ${withUnit(e, 'm')} (${numberText(e / s, 2)} σ)` : '',
    element('br'),
    `seen from ${numberText(m.first_s[i] + T0, 4)} s, used ${m.accepted[i]} of ${m.tried[i]}`,
    m.removed_s[i] === m.removed_s[i] ? `, removed ${numberText(m.removed_s[i] + T0, 4)} s` : '',
  ];
}

/** Section "Map", if an estimator has a position in a plane or in space. */
function mapSection(main) {
  const hasPosition = (e) =>
    e.position && e.blocks.find((b) => b.name === e.position).value.length > 1;
  if (!RUN.estimators.some(hasPosition)) return;
  const box = section('map', 'Map', '', main);
  const view = new MapView();
  const orbit = new MapView(view);
  const rays = view.marks.length ? '; rays lead to the landmarks seen then, red if rejected' : '';
  figure(box, {
    title: 'Trajectory' + (view.marks.length ? ' and landmarks' : ''),
    hint:
      `Dashed: truth. Left: ${view.fitted}, seen from above. Right: drag to turn, shift-drag ` +
      'to move; click, then use the wheel, to zoom. Both show the time of the slider and ' +
      `follow the cursor of the plots${rays}.`,
    plots: [view, orbit],
    controls: view.controls,
    className: 'maps',
  });
  if (view.marks.length) landmarkFigures(box);
}
