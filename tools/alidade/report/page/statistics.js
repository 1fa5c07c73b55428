// SPDX-License-Identifier: Apache-2.0
// Statistics: chi-square, quantiles, intervals, and searches in sorted columns.

function gammaP(a, x) {
  // regularised lower incomplete gamma function
  if (x <= 0) return 0;
  let lg = 0;
  let b = a;
  while (b < 12) {
    lg -= Math.log(b);
    b++;
  }
  lg += (b - 0.5) * Math.log(b) - b + 0.9189385332046727 + 1 / (12 * b) - 1 / (360 * b ** 3);
  const front = Math.exp(-x + a * Math.log(x) - lg);
  if (x < a + 1) {
    let s = 1 / a;
    let term = s;
    for (let n = 1; n < 500 && term > s * 1e-14; n++) {
      term *= x / (a + n);
      s += term;
    }
    return s * front;
  }
  let q = x + 1 - a;
  let c = 1e300;
  let d = 1 / q;
  let f = d; // continued fraction of the upper part, modified Lentz
  for (let i = 1; i < 500; i++) {
    const n = -i * (i - a);
    q += 2;
    d = 1 / (n * d + q || 1e-300);
    c = q + n / c || 1e-300;
    f *= c * d;
    if (Math.abs(c * d - 1) < 1e-13) break;
  }
  return 1 - f * front;
}

const chi2memo = new Map();

function chi2inv(p, dof) {
  const key = p + '/' + dof;
  if (!chi2memo.has(key)) {
    let lo = 0;
    let hi = dof + 10 * Math.sqrt(2 * dof) + 60;
    for (let i = 0; i < 90; i++) {
      const m = (lo + hi) / 2;
      if (gammaP(dof / 2, m / 2) < p) lo = m;
      else hi = m;
    }
    chi2memo.set(key, (lo + hi) / 2);
  }
  return chi2memo.get(key);
}

function quantiles(values, ps) {
  const a = Array.from(values)
    .filter((v) => !Number.isNaN(v))
    .sort((x, y) => x - y);
  return ps.map((p) => {
    if (!a.length) return NaN;
    const k = p * (a.length - 1);
    const i = Math.floor(k);
    return i + 1 < a.length && k > i ? a[i] + (k - i) * (a[i + 1] - a[i]) : a[i];
  });
}

/** Index of the first t >= v. */
function lower(t, v) {
  let a = 0;
  let b = t.length;
  while (a < b) {
    const m = (a + b) >> 1;
    if (t[m] < v) a = m + 1;
    else b = m;
  }
  return a;
}

function nearest(t, v) {
  const i = lower(t, v);
  return i === 0 ? 0 : i === t.length ? i - 1 : v - t[i - 1] < t[i] - v ? i - 1 : i;
}

/** Autocorrelation of {values, landmarks}; the observations of a landmark are one series. */
function autocorrelation({values, landmarks}, lags) {
  const series = new Map();
  landmarks.forEach((id, i) => {
    if (!series.has(id)) series.set(id, []);
    series.get(id).push(i);
  });
  const products = new Float64Array(lags + 1);
  const counts = new Float64Array(lags + 1);
  for (const rows of series.values())
    for (const column of values)
      for (let i = 0; i < rows.length; i++)
        for (let lag = 0; lag <= lags && i + lag < rows.length; lag++) {
          products[lag] += column[rows[i]] * column[rows[i + lag]];
          counts[lag]++;
        }
  const mean = (lag) => products[lag] / Math.max(1, counts[lag]);
  return {
    rho: Array.from(products, (_, lag) => mean(lag) / mean(0)),
    bound: (lag) => 1.96 / Math.sqrt(Math.max(1, counts[lag])),
  };
}
