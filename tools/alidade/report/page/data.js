// SPDX-License-Identifier: Apache-2.0
// Data of the page: the JSON object that the program wrote, and its columns.

const caches = [];

/** A map of results that is emptied when the data change. */
function newCache() {
  caches.push(new Map());
  return caches[caches.length - 1];
}

const decoded = newCache();

function bytes(base64) {
  const s = atob(base64);
  const out = new Uint8Array(s.length);
  for (let i = 0; i < s.length; i++) out[i] = s.charCodeAt(i);
  return out.buffer;
}

/**
 * Numbers of a long series: the sign, and the logarithm of the magnitude. The power of a level is
 * the product of the powers of its upper and lower bits, which two tables contain.
 */
function decodeSeries(codes, {v: start, s: step}) {
  const power = (exponent) => 2 ** exponent;
  const upper = Float64Array.from({length: 128}, (_, k) => power(start + step * (256 * k - 1)));
  const lower = Float64Array.from({length: 256}, (_, k) => power(step * k));
  const numbers = new Float32Array(codes.length);
  for (let i = 0; i < codes.length; i++) {
    const level = codes[i] & 0x7fff;
    const sign = codes[i] & 0x8000 ? -1 : 1;
    if (level === 0) numbers[i] = 0;
    else if (level === 32767) numbers[i] = NaN;
    else if (level === 32766) numbers[i] = sign * Infinity;
    else numbers[i] = sign * upper[level >> 8] * lower[level & 255];
  }
  return numbers;
}

/** Numbers of a column with steps; -32768: no value. */
function decodeSteps(codes, step) {
  const numbers = new Float32Array(codes.length);
  for (let i = 0; i < codes.length; i++) numbers[i] = codes[i] === -32768 ? NaN : codes[i] * step;
  return numbers;
}

/** The elements of a column at the indices of another column. */
function decodeSelection(source, indices) {
  const numbers = new Float64Array(indices.length);
  for (let i = 0; i < indices.length; i++) numbers[i] = source[indices[i]];
  return numbers;
}

function decode(c) {
  switch (c.d) {
    case 'lin':
      return Float64Array.from({length: c.n}, (_, i) => c.v + i * c.s);
    case 'const':
      return new Float32Array(c.n).fill(c.v === null ? NaN : c.v);
    case 'take':
      return decodeSelection(columnOf(c.of), columnOf(c.i));
    case 'f8':
      return new Float64Array(bytes(c.b));
    case 'u1':
      return new Uint8Array(bytes(c.b));
    case 'u2':
      return new Uint16Array(bytes(c.b));
    case 'u4':
      return new Uint32Array(bytes(c.b));
    case 'l2':
      return decodeSeries(new Uint16Array(bytes(c.b)), c);
    case 'i2':
      return decodeSteps(new Int16Array(bytes(c.b)), c.s);
    case 'f4': {
      const f = new Float32Array(bytes(c.b));
      return c.o ? Float64Array.from(f, (v) => v + c.o) : f;
    }
  }
  throw new Error('column of unknown kind ' + c.d);
}

function columnOf(ref) {
  if (ref === null || ref === undefined) return null;
  if (!decoded.has(ref)) decoded.set(ref, decode(DATA.columns[ref]));
  return decoded.get(ref);
}

let DATA;
let RUN;
let COMPARISON;
let SWEEP;
/** Names of the estimators. */
let NAMES;
/** The estimators with a verdict. Trajectories from files have none. */
let JUDGED;
/** Offset of the displayed times: those of the files, unless these count from 1970. */
let T0;
/** True: the run has times. The cameras of a bundle adjustment may have numbers only. */
let HAS_TIMES;

function namesOfEstimators({run, compare, sweep, explain}) {
  if (sweep) return unique(sweep.groups.map((g) => g.estimator));
  const problems = explain ? explain.problems : [];
  const {estimators} = run || compare || {estimators: problems.flatMap((p) => p.estimators)};
  return estimators.map((e) => e.name);
}

/** Sets the data of the page. `run` contains the content of data.run. */
function setData(data, run = data.run) {
  if (data.format !== 'alidade-report' || data.version !== 1)
    throw new Error('this page cannot read its data');
  for (const cache of caches) cache.clear();
  DATA = data;
  RUN = run;
  COMPARISON = data.compare;
  SWEEP = data.sweep;
  HAS_TIMES = Boolean(RUN) && (!data.bundle || data.bundle.has_times);
  NAMES = namesOfEstimators(data);
  JUDGED = RUN ? RUN.estimators.filter((e) => e.verdict) : [];
  T0 = RUN && Math.abs(RUN.t0) < 1e6 ? RUN.t0 : 0;
}

setData(JSON.parse(document.getElementById('data').textContent));

const isZero = (ref) => DATA.columns[ref].d === 'const' && DATA.columns[ref].v === 0;

/** The truth of an element. The name of a truth is that of the block, or its last component. */
function truthOf(block, element) {
  const end = element ? '.' + element : '';
  const whole = RUN.truth[block.name + end];
  return columnOf(whole === undefined ? RUN.truth[block.name.split('.').pop() + end] : whole);
}

/** Use of a measurement with the outcome `code`: accepted, initialised, rejected or unused. */
const useOf = (code) => RUN.outcomes[code].use;
const isAccepted = (code) => useOf(code) === 'accepted';
const isUsed = (code) => isAccepted(code) || useOf(code) === 'initialised';
const isRejected = (code) => useOf(code) === 'rejected';

/** Number of measurements of a sensor with one of these uses. */
const countOfUses = (e, sensor, uses) =>
  sum(
    RUN.outcomes
      .filter((outcome) => uses.includes(outcome.use))
      .map((outcome) => e.counts[`${outcome.name}:${sensor}`] || 0),
  );
const rejectedCount = (e, sensor) => countOfUses(e, sensor, ['rejected']);
const usedCount = (e, sensor) => countOfUses(e, sensor, ['accepted', 'initialised']);
const givenCount = (e, sensor) =>
  sum(RUN.outcomes.map((outcome) => e.counts[`${outcome.name}:${sensor}`] || 0));

/** True if the page contains a part of the innovations of a sensor: those with the largest NIS. */
const isThinned = (e, I) => givenCount(e, I.sensor) > columnOf(I.outcome).length;

/** The columns of the landmarks of an estimator. */
const mapColumns = (e) =>
  Object.fromEntries(Object.entries(e.landmarks).map(([key, ref]) => [key, columnOf(ref)]));
