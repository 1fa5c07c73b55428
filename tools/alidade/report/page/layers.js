// SPDX-License-Identifier: Apache-2.0
// Painters of the layers of a plot, by their kind.

const colourOfLayer = (layer) => (layer.color ? layer.color() : colorOf(layer.est));
const alphaOfLayer = (layer) => dim(layer.est) * (layer.alpha === undefined ? 1 : layer.alpha);

/** The rows of a layer in the visible time; all rows if the x axis is not time. */
function visibleRows({x}, {spec, X}) {
  if (!spec.time) return [0, x.length];
  return [Math.max(0, lower(x, X.lo) - 1), Math.min(x.length, lower(x, X.hi) + 1)];
}

function paintHorizontal(surface, layer, {f, Y}) {
  const y = Y.to(layer.v);
  const color = colourOfLayer(layer);
  const style = {stroke: color, dash: layer.dash || [5, 4], width: 1.2};
  surface.path([f.l, y, f.r, y], {...style, alpha: alphaOfLayer(layer)});
  if (!layer.text) return;
  const place = y > f.t + 14 ? y - 7 : y + 8;
  surface.text(layer.text, f.r - 4, place, {align: 'right', size: 10.5, color, halo: true});
}

function paintVertical(surface, layer, {f, X}) {
  const x = X.to(layer.v);
  const style = {stroke: colourOfLayer(layer), dash: layer.dash || [4, 4]};
  surface.path([x, f.t, x, f.b], {...style, alpha: alphaOfLayer(layer)});
}

function paintZone(surface, layer, {f, Y}) {
  const top = clamp(Y.to(layer.hi), f.t, f.b);
  const bottom = clamp(Y.to(layer.lo), f.t, f.b);
  const fill = layer.color ? layer.color() : colours.shade;
  surface.rect(f.l, top, f.r - f.l, bottom - top, {fill, alpha: layer.alpha ?? 1});
}

function paintBand(surface, layer, plot) {
  const {f, X, Y} = plot;
  const color = colourOfLayer(layer);
  const alpha = alphaOfLayer(layer);
  for (const piece of outline(layer, ...visibleRows(layer, plot), X, Y, f.r - f.l)) {
    surface.path(piece, {fill: color, alpha: alpha * (layer.fill || 0.14)});
    if (!layer.edge) continue;
    const half = piece.length / 2;
    const style = {stroke: color, width: 0.9, alpha: 0.55 * alpha};
    surface.path(piece.slice(0, half), style);
    surface.path(piece.slice(half), style);
  }
}

/** Draws a line. Adds the estimator to plot.lost if the line leaves the axis. */
function paintLine(surface, layer, plot) {
  const {f, X, Y, spec} = plot;
  const points = layer.step
    ? steps(layer, X, Y)
    : trace(layer.x, layer.y, ...visibleRows(layer, plot), X, Y, f.r - f.l, layer.gap);
  const isFocused = layer.est && page.focus === layer.est;
  surface.path(points, {
    stroke: colourOfLayer(layer),
    width: (layer.width || 1.5) * (isFocused ? 1.6 : 1),
    dash: layer.dash || (layer.est ? dashOf(layer.est) : []),
    alpha: alphaOfLayer(layer),
  });
  if (!spec.time || !layer.est) return;
  let outside = 0;
  for (let i = 1; i < points.length; i += 2)
    if (points[i] < f.t - 1 || (points[i] > f.b + 1 && !spec.y.log)) outside++;
  if (outside > 2) plot.lost.add(layer.est);
}

/** The places [x, y, ...] of the dots inside the axes. layer.keep: all, on the edge if outside. */
function dotPlaces(layer, plot) {
  const {f, X, Y} = plot;
  const [begin, end] = visibleRows(layer, plot);
  const places = [];
  for (let i = begin; i < end; i++) {
    if (layer.only && !layer.only(i)) continue;
    const x = X.to(layer.x[i]);
    const y = Y.to(layer.y[i]);
    if (Number.isNaN(y) || x < f.l - 3 || x > f.r + 3) continue;
    if (layer.keep) places.push(x, clamp(y, f.t + 4, f.b - 4));
    else if (y >= f.t && y <= f.b) places.push(x, y);
  }
  return places;
}

/** Draws dots. A dense cloud is drawn as the pixels that it covers, which is the same picture. */
function paintDots(surface, layer, plot) {
  const {l, r, t, b} = plot.f;
  const color = colourOfLayer(layer);
  const alpha = alphaOfLayer(layer);
  const places = dotPlaces(layer, plot);
  if (layer.keep || places.length <= 8000) {
    const isOpen = layer.shape === 'cross' || layer.shape === 'plus';
    const style = isOpen ? {stroke: color, alpha, width: layer.width} : {fill: color, alpha};
    surface.marks(places, layer.shape || 'dot', layer.size || 2, style);
    return;
  }
  const height = Math.ceil(b - t) + 2;
  const width = Math.ceil(r - l) + 2;
  const cells = new Uint8Array(width * height);
  for (let i = 0; i < places.length; i += 2)
    cells[Math.max(0, (places[i] - l) | 0) * height + ((places[i + 1] - t) | 0)] = 1;
  surface.runs(cells, width, height, l, t, {fill: color, alpha});
}

const LAYER_PAINTERS = {
  h: paintHorizontal,
  v: paintVertical,
  hband: paintZone,
  band: paintBand,
  line: paintLine,
  dots: paintDots,
  custom: (surface, layer, plot) => layer.paint(surface, plot.X, plot.Y, plot),
};
