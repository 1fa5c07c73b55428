// SPDX-License-Identifier: Apache-2.0
// Innovations of the sensors: NIS, normalised innovations, and sums over the frames.

/** The innovations of a sensor of an estimator, or undefined. */
const innovationsOf = (e, sensor) => e.innovations.find((I) => I.sensor === sensor);

/** f(key object, ...), computed once for each key object of the same data. */
function once(f) {
  const results = newCache();
  return (key, ...more) => {
    if (!results.has(key)) results.set(key, f(key, ...more));
    return results.get(key);
  };
}

/** NIS divided by the degrees of freedom. */
const nisOf = once((I) => Float32Array.from(columnOf(I.nis), (v) => v / (I.dof || 1)));

/** NIS, with a huge value for rejected measurements without NIS: they are drawn on the edge. */
const nisWithRejected = once((I) => {
  const outcomes = columnOf(I.outcome);
  return nisOf(I).map((v, i) => (isRejected(outcomes[i]) && Number.isNaN(v) ? 1e30 : v));
});

/** Accepted normalised innovations: {values: a list for each element, landmarks}. */
const normalisedOf = once((I) => {
  const outcomes = columnOf(I.outcome);
  const landmarks = columnOf(I.landmark);
  const divide = (ref, k) => {
    const sigma = columnOf(I.s[k]);
    return columnOf(ref).map((v, i) => v / sigma[i]);
  };
  const elements = I.nu ? I.nu.map(columnOf) : I.r.map(divide);
  const rows = [];
  for (let i = 0; i < outcomes.length; i++)
    if (isAccepted(outcomes[i]) && elements.every((c) => Number.isFinite(c[i]))) rows.push(i);
  return {
    values: elements.map((c) => rows.map((i) => c[i])),
    landmarks: rows.map((i) => (landmarks ? landmarks[i] : 0)),
  };
});

/** Frames of a sensor of landmarks: {t, used, rejected, rms}, a list each. */
const framesOf = once((I) => {
  const times = columnOf(I.t);
  const outcomes = columnOf(I.outcome);
  const r = I.r.map(columnOf);
  const frames = {t: [], used: [], rejected: [], rms: []};
  for (let begin = 0, end = 0; begin < times.length; begin = end) {
    let used = 0;
    let rejected = 0;
    const squares = [];
    for (; end < times.length && times[end] === times[begin]; end++) {
      if (isUsed(outcomes[end])) used++;
      if (isRejected(outcomes[end])) rejected++;
      if (isAccepted(outcomes[end]))
        for (const c of r) if (Number.isFinite(c[end])) squares.push(c[end] ** 2);
    }
    frames.t.push(times[begin]);
    frames.used.push(used);
    frames.rejected.push(rejected);
    frames.rms.push(squares.length ? Math.sqrt(sum(squares) / squares.length) : NaN);
  }
  return frames;
});

/** Number of distinct times in a sorted column. */
const distinctCount = once((times) => {
  let n = 1;
  for (let i = 1; i < times.length; i++) if (times[i] !== times[i - 1]) n++;
  return n;
});

/** Layer of the rejected measurements: each is drawn as a cross. */
const rejectedLayer = (e, x, y, only, name = `${e.name} rejected`) => ({
  kind: 'dots',
  x,
  y,
  only,
  name,
  est: e.name,
  color: REJECTED,
  shape: 'cross',
  size: 3.4,
  width: 1.6,
  keep: true,
  fit: false,
});
