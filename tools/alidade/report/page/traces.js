// SPDX-License-Identifier: Apache-2.0
// Lines and bands as pixels. No peak is lost, however many points there are.

/** Points of a line: all, or the first, least, greatest and last of each pixel column. */
function trace(x, y, i0, i1, X, Y, width, gap) {
  const out = [];
  const {k, c} = X; // x is linear where there are many points
  if (i1 - i0 < 3 * width) {
    for (let i = i0; i < i1; i++) {
      if (gap && i > i0 && x[i] - x[i - 1] > gap) out.push(0, NaN);
      out.push(X.to(x[i]), Y.to(y[i]));
    }
    return out;
  }
  let column = NaN;
  let first = 0;
  let last = 0;
  let lo = 0;
  let hi = 0;
  let any = false;
  let drawn = NaN;
  let skipped = NaN;
  const point = (v) => {
    // leaves out what moves the pen by less than half a pixel
    const p = Y.to(v);
    if (Math.abs(p - drawn) < 0.5) {
      skipped = p;
      return;
    }
    if (skipped === skipped) out.push(column - 0.5, skipped);
    out.push(column + 0.5, p);
    drawn = p;
    skipped = NaN;
  };
  const put = () => {
    if (any) {
      point(first);
      if (lo < first && lo < last) point(lo);
      if (hi > first && hi > last) point(hi);
      point(last);
    }
    any = false;
  };
  for (let i = i0; i < i1; i++) {
    const v = y[i];
    const p = (k * x[i] + c) | 0;
    if (v !== v) {
      put();
      out.push(p, NaN);
      drawn = skipped = NaN;
      continue;
    }
    if (!any || p !== column) {
      put();
      column = p;
      first = lo = hi = last = v;
      any = true;
    } else {
      last = v;
      if (v < lo) lo = v;
      if (v > hi) hi = v;
    }
  }
  put();
  if (skipped === skipped) out.push(column + 0.5, skipped);
  return out;
}

/** Outline of the band from c - m s to c + m s, or from lo to hi, in pieces between gaps. */
function outline(L, i0, i1, X, Y, width) {
  const pieces = [];
  const dense = i1 - i0 > 3 * width;
  const {k, c} = X;
  const {x, s, m, lo: low, hi: high} = L;
  const mid = L.c;
  const log = X.log;
  let up = [];
  let down = [];
  let column = NaN;
  let a = 0;
  let b = 0;
  let open = false;
  let at = 0;
  const edge = (v) => clamp(Y.to(v), -9000, 9000);
  const put = () => {
    if (open) {
      up.push(at, edge(b));
      down.push(at, edge(a));
    }
    open = false;
  };
  const close = () => {
    put();
    if (up.length > 2) {
      const d = [];
      for (let i = down.length - 2; i >= 0; i -= 2) d.push(down[i], down[i + 1]);
      pieces.push(up.concat(d));
    }
    up = [];
    down = [];
    column = NaN;
  };
  for (let i = i0; i < i1; i++) {
    const w = s ? m * s[i] : 0;
    const v = mid ? mid[i] : 0;
    const p = low ? low[i] : v - w;
    const q = high ? high[i] : v + w;
    if (!(q >= p)) {
      close();
      continue;
    }
    const px = log ? X.to(x[i]) : k * x[i] + c;
    if (dense && open && (px | 0) === column) {
      if (p < a) a = p;
      if (q > b) b = q;
      continue;
    }
    put();
    column = px | 0;
    at = px;
    a = p;
    b = q;
    open = true;
  }
  close();
  return pieces;
}

function steps(L, X, Y) {
  const p = [];
  for (let i = 0; i < L.y.length; i++)
    p.push(
      X.to(L.x[i]),
      Y.to(L.y[i]),
      X.to(L.x2 ? L.x2[i] : L.x[i + 1] === undefined ? X.hi : L.x[i + 1]),
      Y.to(L.y[i]),
    );
  return p;
}

/** The median step between sorted times. */
const medianStep = (times) =>
  quantiles(
    Array.from(times.slice(1, 2000), (t, i) => t - times[i]),
    [0.5],
  )[0];

/**
 * The part of a line with values: true values can be rarer than frames. {x, y, s, gap}: the line
 * connects the values, except over a gap.
 */
function knownPart(x, y, s) {
  const rows = Array.from(y.keys()).filter((i) => y[i] === y[i]);
  if (rows.length === y.length) return {x, y, s};
  const pick = (values) => values && Float64Array.from(rows, (i) => values[i]);
  const times = pick(x);
  return {x: times, y: pick(y), s: pick(s), gap: 6 * medianStep(times)};
}
