// SPDX-License-Identifier: Apache-2.0
// Timeline: the whole run on one line, with the visible time.

const TIMELINE_MARGIN = 8;

/** Segments, events and the visible window. A drag selects a window, a click moves it. */
class Timeline {
  constructor() {
    this.spec = {label: 'timeline'};
    this.dirty = true;
    this.seen = true;
    this.base = element('canvas', {class: 'base'});
    this.over = this.base;
    const title = 'drag: zoom all plots; click: go there; double-click: show all';
    this.el = element('div', {class: 'timeline', title}, this.base);
    this.el.plot = this;
    this.drag = null;
    plots.add(this);
    resizer.observe(this.el);
    this.follow();
  }

  /** The time at the pointer. */
  timeAt(event) {
    const x = event.clientX - this.base.getBoundingClientRect().left - TIMELINE_MARGIN;
    const share = clamp(x / (this.w - 2 * TIMELINE_MARGIN), 0, 1);
    return page.full[0] + share * (page.full[1] - page.full[0]);
  }

  eventsAt(time) {
    return eventsNear(time, ((page.full[1] - page.full[0]) * 6) / this.w);
  }

  follow() {
    this.base.addEventListener('pointerdown', (event) => {
      this.base.setPointerCapture(event.pointerId);
      this.drag = [this.timeAt(event), this.timeAt(event)];
    });
    this.base.addEventListener('pointermove', (event) => {
      const time = this.timeAt(event);
      if (this.drag) {
        this.drag[1] = time;
        this.draw();
        return;
      }
      page.cursor = time;
      cursorMoved();
      this.showEvents(event, time);
    });
    this.base.addEventListener('pointerup', () => this.endDrag());
    this.base.addEventListener('pointerleave', () => {
      hideTip();
      page.cursor = null;
      cursorMoved();
    });
    this.base.addEventListener('dblclick', () => zoomTo(...page.full));
  }

  showEvents(event, time) {
    const lines = this.eventsAt(time)
      .slice(0, 5)
      .map(([name, [at, kind, text]]) => {
        const content = ` ${clock(at)} s ${kind.replace(/_/g, ' ')}: ${text}`;
        return element('p', {class: 'event'}, nameOf(name), content);
      });
    if (lines.length) showTip(event, lines);
    else hideTip();
  }

  endDrag() {
    if (!this.drag) return;
    const [from, to] = [Math.min(...this.drag), Math.max(...this.drag)];
    this.drag = null;
    if (to - from > (page.full[1] - page.full[0]) * 0.005) {
      zoomTo(from, to);
      return;
    }
    const [event] = this.eventsAt(from);
    goTo(event ? event[1][0] : from);
  }

  paintOver() {
    this.draw();
  }

  draw() {
    this.w = this.el.clientWidth;
    const height = this.el.clientHeight;
    if (!this.w) return;
    const ratio = window.devicePixelRatio || 1;
    const size = [Math.round(this.w * ratio), Math.round(height * ratio)];
    if (this.base.width !== size[0] || this.base.height !== size[1])
      [this.base.width, this.base.height] = size;
    const context = this.base.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.w, height);
    this.dirty = false;
    this.paint(new CanvasSurface(context), height);
  }

  paint(surface, height) {
    const inner = this.w - 2 * TIMELINE_MARGIN;
    const X = (t) =>
      TIMELINE_MARGIN + ((t - page.full[0]) / (page.full[1] - page.full[0])) * inner;
    surface.rect(TIMELINE_MARGIN, 3, inner, height - 14, {fill: colours.grid});
    for (const {name, spans} of shaded())
      for (const [from, to] of spans) {
        const width = X(to) - X(from);
        surface.rect(X(from), 3, width, height - 14, {fill: colours.faint, alpha: 0.35});
        const style = {align: 'center', size: 10};
        if (width > 50) surface.text(name, X(from) + width / 2, 3 + (height - 14) / 2, style);
      }
    const [from, to] = this.drag ? this.drag.slice().sort((a, b) => a - b) : page.x;
    if (from > page.full[0] || to < page.full[1]) {
      const style = {fill: colours.accent, alpha: 0.22, stroke: colours.accent};
      surface.rect(X(from), 2, X(to) - X(from), height - 12, style);
    }
    for (const [name, [time]] of eventsNear()) {
      const style = {fill: colorOf(name), alpha: dim(name)};
      if (time !== null) surface.rect(X(time) - 1, 3, 2, height - 14, style);
    }
    const time = page.cursor ?? page.time;
    if (time !== null) surface.rect(X(time) - 0.5, 0, 1, height - 9, {fill: colours.ink});
    const right = {size: 9.5, align: 'right'};
    surface.text(clock(page.full[0]) + ' s', TIMELINE_MARGIN, height - 4, {size: 9.5});
    surface.text(clock(page.full[1]) + ' s', this.w - TIMELINE_MARGIN, height - 4, right);
  }
}
