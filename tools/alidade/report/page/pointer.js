// SPDX-License-Identifier: Apache-2.0
// Pointer and keys on a plot: cursor, zoom, tips.

/** Width of a few pixels, in s. */
const tolerance = ({f}) => ((page.x[1] - page.x[0]) * 5) / (f.r - f.l);

/** The values of the lines and dots at a time. */
function valueRows(plot, time) {
  const {X, layers, factor, unit} = plot;
  const rows = [];
  for (const L of layers) {
    if (!L.name || !L.x || !L.x.length || (L.kind !== 'line' && L.kind !== 'dots')) continue;
    const i = nearest(L.x, time);
    const distance = Math.abs(X.to(L.x[i]) - X.to(time));
    if (distance > 12 || Number.isNaN(L.y[i]) || (L.only && !L.only(i))) continue;
    const sigma = L.s ? ' ± ' + numberText(3 * L.s[i] * factor, 2) : '';
    const value = numberText(L.y[i] * factor) + sigma + (unit ? ' ' + unit : '');
    const name = element('td', {class: 'name', style: `color: ${colourOfLayer(L)}`}, L.name);
    rows.push(element('tr', {}, name, element('td', {}, value)));
  }
  return rows;
}

/** The content of the tip at a time. */
function timeTip(plot, time) {
  const rows = valueRows(plot, time);
  const hasSigma = plot.layers.some((L) => L.s && L.name);
  const events = eventsNear(time, tolerance(plot)).slice(0, 3);
  return [
    element('b', {}, `t = ${clock(time)} s`),
    rows.length ? element('table', {}, rows) : null,
    hasSigma ? element('span', {class: 'quiet'}, '± is 3σ') : null,
    events.map(([name, [, kind, text]]) =>
      element('p', {class: 'event'}, nameOf(name), ` ${kind.replace(/_/g, ' ')}: ${text}`),
    ),
  ];
}

/** Finds the dot below the pointer, and shows its tip. Returns {layer, index, place} or null. */
function dotBelow(plot, event) {
  const box = plot.over.getBoundingClientRect();
  const [mx, my] = [event.clientX - box.left, event.clientY - box.top];
  let least = 14 * 14;
  plot.hit = null;
  for (const layer of plot.layers.filter((L) => L.kind === 'dots' && L.tip))
    for (let index = 0; index < layer.x.length; index++) {
      const place = [plot.X.to(layer.x[index]), plot.Y.to(layer.y[index])];
      const distance = (place[0] - mx) ** 2 + (place[1] - my) ** 2;
      if (distance >= least) continue;
      least = distance;
      plot.hit = {layer, index, place};
    }
  plot.paintOver();
  if (plot.hit) showTip(event, plot.hit.layer.tip(plot.hit.index));
  else hideTip();
  return plot.hit;
}

function followDots(plot) {
  plot.over.addEventListener('pointermove', (event) => {
    if (plot.f) dotBelow(plot, event);
  });
  plot.over.addEventListener('pointerleave', () => {
    hideTip();
    plot.hit = null;
    if (plot.f) plot.paintOver();
  });
}

/** Ends a drag: a long drag zooms, a click keeps the time. */
function endDrag(plot, drag, x) {
  const {f, X} = plot;
  if (Math.abs(drag[1] - drag[0]) > 4) {
    const [from, to] = [Math.min(...drag), Math.max(...drag)].map((p) => clamp(p, f.l, f.r));
    zoomTo(X.from(from), X.from(to));
    return;
  }
  const time = X.from(x);
  const [event] = eventsNear(time, tolerance(plot));
  page.time = event ? event[1][0] : time;
  redraw();
}

/** A drag selects a window of time. With shift, it moves the window. */
function followDrag(plot) {
  const {over} = plot;
  const xOf = (event) => event.clientX - over.getBoundingClientRect().left;
  over.addEventListener('pointerdown', (event) => {
    if (event.pointerType !== 'mouse' || event.button) return;
    over.setPointerCapture(event.pointerId);
    plot.drag = [xOf(event), xOf(event)];
    plot.pan = event.shiftKey ? page.x.slice() : null;
  });
  over.addEventListener('pointermove', (event) => {
    if (!plot.f) return;
    page.cursor = clamp(plot.X.from(xOf(event)), page.x[0], page.x[1]);
    if (plot.drag) plot.drag[1] = xOf(event);
    if (plot.drag && plot.pan) {
      const [from, to] = plot.pan;
      const move = ((plot.drag[0] - plot.drag[1]) / (plot.f.r - plot.f.l)) * (to - from);
      zoomTo(from + move, to + move);
    }
    cursorMoved();
    showTip(event, timeTip(plot, page.cursor));
  });
  over.addEventListener('pointerup', (event) => {
    const {drag, pan} = plot;
    plot.drag = plot.pan = null;
    if (drag && !pan && plot.f) endDrag(plot, drag, xOf(event));
  });
}

function followTime(plot) {
  const {over} = plot;
  followDrag(plot);
  over.addEventListener('pointerleave', () => {
    hideTip();
    page.cursor = null;
    cursorMoved();
  });
  over.addEventListener('dblclick', () => zoomTo(...page.full));
  over.addEventListener('keydown', timeKey);
  const onwheel = (event) => {
    if (!event.ctrlKey && !event.metaKey && !event.shiftKey) return;
    event.preventDefault();
    const x = event.clientX - over.getBoundingClientRect().left;
    zoomBy(Math.exp((event.deltaY || event.deltaX) * 0.002), plot.X.from(x));
  };
  over.addEventListener('wheel', onwheel, {passive: false});
}

/** Keys on a plot over time. */
function timeKey(event) {
  const middle = (page.x[0] + page.x[1]) / 2;
  const time = page.cursor ?? page.time ?? middle;
  const width = page.x[1] - page.x[0];
  const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
  if (step && event.shiftKey) zoomTo(...page.x.map((x) => x + step * width * 0.2));
  else if (step) {
    page.time = clamp(time + (step * width) / 200, ...page.x);
    page.cursor = null;
    redraw();
  } else if (event.key === '+' || event.key === '=') zoomBy(0.6, time);
  else if (event.key === '-') zoomBy(1 / 0.6, time);
  else if (event.key === '0' || event.key === 'Escape') zoomTo(...page.full);
  else return;
  event.preventDefault();
}
