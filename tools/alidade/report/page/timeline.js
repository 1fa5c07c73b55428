// SPDX-License-Identifier: Apache-2.0
// Timeline: the whole run on one line, with the visible time.

/** Segments, events and the visible window. A drag selects a window, a click moves it. */
class Timeline {
  constructor() {
    this.spec = {label: 'timeline'};
    this.dirty = true;
    this.seen = true;
    this.base = element('canvas', {
      class: 'base',
      style: 'position:absolute;width:100%;height:100%',
    });
    this.over = this.base;
    this.el = element(
      'div',
      {class: 'timeline', title: 'drag: zoom all plots; click: go there; double-click: show all'},
      this.base,
    );
    this.el.plot = this;
    plots.add(this);
    resizer.observe(this.el);
    const T = (e) =>
      page.full[0] +
      clamp((e.clientX - this.base.getBoundingClientRect().left - 8) / (this.w - 16), 0, 1) *
        (page.full[1] - page.full[0]);
    this.base.addEventListener('pointerdown', (e) => {
      this.base.setPointerCapture(e.pointerId);
      this.from = this.to = T(e);
    });
    this.base.addEventListener('pointermove', (e) => {
      if (this.from !== undefined) {
        this.to = T(e);
        this.draw();
        return;
      }
      const t = T(e);
      const ev = eventsNear(t, ((page.full[1] - page.full[0]) * 6) / this.w);
      page.cursor = t;
      cursorMoved();
      if (ev.length)
        showTip(
          e,
          ev
            .slice(0, 5)
            .map(([n, v]) =>
              element(
                'p',
                {style: 'margin:0'},
                nameOf(n),
                ` ${clock(v[0])} s ${v[1].replace(/_/g, ' ')}: ${v[2]}`,
              ),
            ),
        );
      else hideTip();
    });
    this.base.addEventListener('pointerup', () => {
      const a = Math.min(this.from, this.to);
      const b = Math.max(this.from, this.to);
      this.from = undefined;
      if (b - a > (page.full[1] - page.full[0]) * 0.005) {
        zoomTo(a, b);
        return;
      }
      const ev = eventsNear(a, ((page.full[1] - page.full[0]) * 6) / this.w);
      goTo(ev.length ? ev[0][1][0] : a);
    });
    this.base.addEventListener('pointerleave', () => {
      hideTip();
      page.cursor = null;
      cursorMoved();
    });
    this.base.addEventListener('dblclick', () => zoomTo(...page.full));
  }
  paintOver() {
    this.draw();
  }
  draw() {
    const w = (this.w = this.el.clientWidth);
    const hh = this.el.clientHeight;
    const dpr = window.devicePixelRatio || 1;
    const c = this.base;
    if (!w) return;
    if (c.width !== Math.round(w * dpr)) c.width = Math.round(w * dpr);
    if (c.height !== Math.round(hh * dpr)) c.height = Math.round(hh * dpr);
    const ctx = c.getContext('2d');
    const X = (t) => 8 + ((t - page.full[0]) / (page.full[1] - page.full[0])) * (w - 16);
    const s = new CanvasSurface(ctx);
    ctx.setTransform(dpr, 0, 0, dpr, 0, 0);
    ctx.clearRect(0, 0, w, hh);
    this.dirty = false;
    s.rect(8, 3, w - 16, hh - 14, {fill: colours.grid});
    if (RUN)
      for (const g of shaded())
        for (const [a, b] of g.spans) {
          s.rect(X(a), 3, X(b) - X(a), hh - 14, {fill: colours.faint, alpha: 0.35});
          if (X(b) - X(a) > 50)
            s.text(g.name, (X(a) + X(b)) / 2, 3 + (hh - 14) / 2, {align: 'center', size: 10});
        }
    const win =
      this.from !== undefined
        ? [Math.min(this.from, this.to), Math.max(this.from, this.to)]
        : page.x;
    if (win[0] > page.full[0] || win[1] < page.full[1])
      s.rect(X(win[0]), 2, X(win[1]) - X(win[0]), hh - 12, {
        fill: colours.accent,
        alpha: 0.22,
        stroke: colours.accent,
      });
    if (RUN)
      for (const e of RUN.estimators)
        if (shown(e.name))
          for (const [t] of e.events)
            if (t !== null)
              s.rect(X(t) - 1, 3, 2, hh - 14, {fill: colorOf(e.name), alpha: dim(e.name)});
    const at = page.cursor === null ? page.time : page.cursor;
    if (at !== null) s.rect(X(at) - 0.5, 0, 1, hh - 9, {fill: colours.ink});
    s.text(clock(page.full[0]) + ' s', 8, hh - 4, {size: 9.5});
    s.text(clock(page.full[1]) + ' s', w - 8, hh - 4, {size: 9.5, align: 'right'});
  }
}
