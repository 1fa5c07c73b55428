// SPDX-License-Identifier: Apache-2.0
// Axes: scales and ticks.

function scale(lo, hi, a, b, log) {
  if (log) {
    lo = Math.max(lo, 1e-300);
    hi = Math.max(hi, lo * 1.001);
  }
  const f = log ? Math.log10 : (v) => v;
  const A = f(lo);
  const k = (b - a) / (f(hi) - A || 1);
  const c = a - A * k;
  return {
    lo,
    hi,
    log,
    a,
    b,
    k,
    c,
    to: log ? (v) => c + k * Math.log10(v <= 1e-300 ? 1e-300 : v) : (v) => c + k * v,
    from: (p) => (log ? 10 ** ((p - c) / k) : (p - c) / k),
  };
}

function ticks(s, factor, n) {
  const lo = s.lo * factor;
  const hi = s.hi * factor;
  const out = [];
  if (s.log) {
    // the richest of decades, 1-3 and 1-2-5 that has room
    const a = Math.floor(Math.log10(lo)) - 1;
    const b = Math.ceil(Math.log10(hi)) + 1;
    const sets = [[1, 2, 5], [1, 3], [1]]
      .map((ms) => [ms, 1])
      .concat([2, 3, 4, 6, 10].map((k) => [[1], k]));
    for (const [ms, step] of sets) {
      const set = [];
      for (let e = Math.floor(a / step) * step; e <= b; e += step)
        for (const m of ms) {
          const v = m * 10 ** e;
          if (v >= lo * 0.9999 && v <= hi * 1.0001) set.push(v);
        }
      if (set.length > n + 1.5) continue;
      if (set.length < 2) break;
      return set.map((v) => [
        v / factor,
        v >= 1e5 || v < 1e-3
          ? v.toExponential(0).replace('e+', 'e').replace('-', '−')
          : String(+v.toPrecision(3)),
      ]);
    }
  }
  const raw = (hi - lo) / Math.max(1, n);
  const mag = 10 ** Math.floor(Math.log10(raw));
  const nice = [0.5, 1, 2, 5, 10].map((k) => k * mag);
  const places = (q) => Math.floor(hi / q + 1e-9) - Math.ceil(lo / q - 1e-9) + 1;
  let step = nice.find((q) => q >= raw * 0.999);
  if (places(step) < 3) step = nice[Math.max(0, nice.indexOf(step) - 1)]; // at least three
  if (!(step > 0)) return [];
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  for (let v = Math.ceil(lo / step - 1e-9) * step; v <= hi + step * 1e-9; v += step)
    out.push([
      v / factor,
      (Math.abs(v) < step * 1e-6 ? 0 : v).toFixed(Math.min(digits, 8)).replace('-', '−'),
    ]);
  return Math.max(Math.abs(lo), Math.abs(hi)) >= 1e6
    ? out.map(([v]) => [v, numberText(v * factor)])
    : out;
}

const niceStep = (raw) => {
  const m = 10 ** Math.floor(Math.log10(raw));
  return m * [1, 2, 5, 10].find((k) => k * m >= raw * 0.8);
};
