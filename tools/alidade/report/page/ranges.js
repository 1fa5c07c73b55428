// SPDX-License-Identifier: Apache-2.0
// Ranges of the axes of a plot.

/** The range of all values of the layers on an axis, with a margin. */
function extentOf(layers, axis, log) {
  let lo = Infinity;
  let hi = -Infinity;
  for (const L of layers) {
    if (L.fit === false) continue;
    for (const values of axis === 'x' ? [L.x, L.x2] : [L.y, L.lo, L.hi])
      for (const v of values || []) {
        if (!Number.isFinite(v) || (log && v <= 0)) continue;
        if (v < lo) lo = v;
        if (v > hi) hi = v;
      }
  }
  if (!(hi >= lo)) return log ? [0.1, 10] : [0, 1];
  if (log) {
    const factor = (hi / lo) ** 0.05 * 1.02;
    return [lo / factor, hi * factor];
  }
  const margin = (hi - lo) * 0.05 || Math.abs(hi) * 0.1 || 1;
  return [lo - margin, hi + margin];
}

/** Enlarges one of two ranges, so that both axes have the same scale. */
function equalRanges(x, y, width, height) {
  const scaleOf = ([lo, hi], size) => (hi - lo) / size;
  const common = Math.max(scaleOf(x, width), scaleOf(y, height));
  const enlarged = ([lo, hi], size) => {
    const middle = (lo + hi) / 2;
    return [middle - (common * size) / 2, middle + (common * size) / 2];
  };
  return [enlarged(x, width), enlarged(y, height)];
}

/** Quantiles of the numbers get(layer, i) in the visible time; of many numbers, of a sample. */
function visibleQuantiles(layer, [from, to], get, shares) {
  const begin = lower(layer.x, from);
  const end = lower(layer.x, to + 1e-12);
  const step = Math.max(1, Math.floor((end - begin) / 1500));
  const values = [];
  for (let i = begin; i < end; i += step) {
    const value = get(layer, i);
    if (Number.isFinite(value)) values.push(value);
  }
  return quantiles(values, shares);
}

const valueAt = (layer, i) => layer.y[i];
const fitted = (layers) => layers.filter((L) => L.y && L.x && L.fit !== false);

/** The range of a logarithmic axis over time: from the lower bound of a zone upwards. */
function logRange({layers, full}, time) {
  const positive = (layer, i) => (layer.y[i] > 0 ? layer.y[i] : NaN);
  let lo = Infinity;
  let hi = -Infinity;
  for (const L of fitted(layers)) {
    const [least, most, top] = visibleQuantiles(L, time, positive, [0.01, 0.995, 1]);
    if (least < lo) lo = least;
    const high = full ? top : most;
    if (high > hi) hi = high;
  }
  for (const L of layers) if (L.kind === 'h') hi = Math.max(hi, L.v * 1.2);
  for (const L of layers) {
    if (L.kind !== 'hband') continue;
    hi = Math.max(hi, L.hi * 1.2);
    lo = full ? Math.min(lo, L.lo) : L.lo / 1.5;
  }
  if (!(hi > 0)) return [0.01, 10];
  return [Math.max(lo, hi / 1e6) / 1.3, hi * 1.9];
}

/** The union of intervals; [Infinity, -Infinity] if there is none. */
const union = (intervals) =>
  intervals.reduce(([a, b], [c, d]) => [Math.min(a, c), Math.max(b, d)], [Infinity, -Infinity]);

/**
 * The range that matters: truth, or else zero or the middle of the lines.
 * Returns {base, allowed}; a line may be `allowed` away from the base.
 */
function baseRange(plot, references, lines) {
  const middles = lines.map(([a, b]) => (a + b) / 2);
  const middle = middles.length && !plot.spec.zero ? quantiles(middles, [0.5])[0] : 0;
  const base = references.length ? union(references) : [middle, middle];
  if (plot.full) return {base, allowed: Infinity};
  const distances = lines.map(([a, b]) => Math.max(base[0] - a, b - base[1], 0));
  const median = quantiles(distances, [0.5])[0] || 0;
  const typical = median || Math.min(...distances.filter((d) => d > 0), Infinity);
  return {base, allowed: Math.max(0.45 * (base[1] - base[0]), 4 * typical)};
}

/** The 3-sigma bands that are not much larger than the errors. */
function bandRanges({layers, full, spec}, time, allowed) {
  if (!spec.zero && !full) return [];
  return layers
    .filter((L) => L.kind === 'band' && L.s && L.fit !== false)
    .map((L) => {
      const half = (layer, i) => layer.m * layer.s[i];
      const centre = (layer, i) => layer.c[i];
      const [size] = visibleQuantiles(L, time, half, [full ? 1 : 0.6]);
      const middle = full && L.c ? visibleQuantiles(L, time, centre, [0, 1]) : [0, 0];
      return {size, range: [middle[0] - size, middle[1] + size]};
    })
    .filter(({size}) => size <= (full ? Infinity : 2.5 * allowed || Infinity))
    .map(({range}) => range);
}

/** The range of a linear axis over time: truth, and the lines and bands near it. */
function linearRange(plot, time) {
  const isKnown = ([a]) => !Number.isNaN(a);
  const rangesOf = (layers, shares) =>
    layers.map((L) => visibleQuantiles(L, time, valueAt, shares)).filter(isKnown);
  const all = fitted(plot.layers);
  const references = rangesOf(
    all.filter((L) => L.ref),
    [0, 1],
  );
  const lines = rangesOf(
    all.filter((L) => !L.ref),
    plot.full ? [0, 1] : [0.01, 0.99],
  );
  const {base, allowed} = baseRange(plot, references, lines);
  const near = references.length
    ? lines.map(([a, b]) => [Math.max(a, base[0] - allowed), Math.min(b, base[1] + allowed)])
    : lines.filter(([a, b]) => Math.max(base[0] - a, b - base[1]) <= allowed);
  const [lo, hi] = union([...references, ...near, ...bandRanges(plot, time, allowed)]);
  if (!(hi >= lo)) return [-1, 1];
  if (plot.spec.zero) {
    const most = Math.max(-lo, hi) || 1;
    return [-1.15 * most, 1.15 * most];
  }
  const margin = (hi - lo) * 0.1 || Math.abs(hi) * 0.05 || 1;
  return [lo - margin, hi + margin];
}

/** The range of the y axis of a plot over time. */
const fittedRange = (plot, time) =>
  plot.spec.y.log ? logRange(plot, time) : linearRange(plot, time);
