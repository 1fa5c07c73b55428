// SPDX-License-Identifier: Apache-2.0
// Section "What happened". Verdicts, findings and events are the program's own sentences.

/** The items of the list: {cls, mark, text, more}. */
function story() {
  const items = [];
  const add = (cls, mark, text, more) => items.push({cls, mark, text, more});
  if (DATA.status !== 'ok') {
    const word = DATA.status === 'failed' ? 'failed' : 'was stopped';
    const end = `at ${clock(page.full[1])} s, after ${plural(DATA.frames || 0, 'frame')}`;
    add('bad', '✕', [`The run ${word} ${end}.`], DATA.reason);
  }
  consistentItem(add);
  for (const group of similarEstimators()) estimatorItem(group, add);
  rankItem(add);
  segmentItem(add);
  driftItem(add);
  mapItem(add);
  return items;
}

/** Names of estimators, as a text in their colours. */
const namesOf = (names) =>
  names.map((name, i) => [i ? (i === names.length - 1 ? ' and ' : ', ') : '', nameOf(name)]);

const sentence = (text) => text + (/[.!?]$/.test(text) ? '' : '.');
const isConsistent = (e) => verdictOf(e).state === 'consistent';

/** One item for all consistent estimators. */
function consistentItem(add) {
  const group = RUN.estimators.filter(isConsistent);
  if (!group.length) return;
  const reasons = group.map((e) => {
    const name = group.length > 1 ? [nameOf(e.name), ': '] : '';
    return [name, sentence(verdictOf(e).because), ' '];
  });
  const verb = group.length > 1 ? ' are' : ' is';
  add('good', '✓', [namesOf(group.map((e) => e.name)), verb, ' consistent.'], reasons);
}

/** Groups of estimators with the same verdict, findings and events. */
function similarEstimators() {
  const groups = new Map();
  for (const e of RUN.estimators) {
    const key = JSON.stringify([e.verdict, e.diagnosis, e.events]);
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(e);
  }
  return [...groups.values()];
}

/** One item for estimators with something to report: the verdict, then findings and events. */
function estimatorItem(group, add) {
  const [e] = group;
  const {state, because, since, cls, mark} = verdictOf(e);
  const notes = [...findingTexts(e), ...eventTexts(e), ...excursionText(e), ...fixText(e)];
  const names = namesOf(group.map((member) => member.name));
  if (isConsistent(e)) {
    if (notes.length) add('calm', '·', [names, ': ', notes.shift()], notes);
    return;
  }
  const be = group.length > 1 ? ' are ' : ' is ';
  const verb = state === 'failed' || state === 'diverged' ? ' ' : be;
  const time = since === null ? '' : [' at ', timeLink(since)];
  add(cls, mark, [names, verb, state, time, ': ', sentence(because)], notes);
}

/** The two estimators with the least error of the first block with a truth. */
function rankedEstimators() {
  const block = mainBlock();
  const key = block && 'rmse:' + block.name;
  return RUN.estimators
    .filter((e) => key && e.metrics[key] > 0 && !e.smoothed && verdictOf(e).cls !== 'bad')
    .sort((a, b) => a.metrics[key] - b.metrics[key]);
}

function rankItem(add) {
  const [best, second] = rankedEstimators();
  if (!second || COMPARISON) return;
  const block = mainBlock();
  const error = (e) => e.metrics['rmse:' + block.name];
  const gain = 1 - error(best) / error(second);
  add(
    'calm',
    '★',
    [
      `Least error of ${block.name}: `,
      nameOf(best.name),
      `, ${withUnit(error(best), block.error_unit)} RMSE, `,
      gain < 0.01 ? 'as good as ' : `${percent(gain)} less than `,
      nameOf(second.name),
      '.',
    ],
    'This is one seed; alidade sweep --runs 100 shows whether the difference is chance.',
  );
}

const findingTexts = (e) => (e.diagnosis || []).map((finding) => sentence(finding.text) + ' ');

/** Kinds of events whose content a verdict reports. */
const VERDICT_KINDS = /^(diverged|lost|mostly_rejected|nees_bounds|nis_bounds)$/;

/** One text for each kind of event: the first event, and the number of the others. */
function eventTexts(e) {
  const kinds = unique(e.events.map((event) => event[1]));
  return kinds
    .filter((kind) => !VERDICT_KINDS.test(kind))
    .map((kind) => {
      const events = e.events.filter((event) => event[1] === kind);
      const [time, , text] = events[0];
      const others = events.length > 1 ? ` (${events.length - 1} more)` : '';
      const place = time === null ? '' : [' at ', timeLink(time)];
      const name = kind.replace(/_/g, ' ');
      return [name[0].toUpperCase() + name.slice(1), place, others, ': ', sentence(text), ' '];
    });
}

/** {longest, start, outside} of the runs of timestamps with an error outside 3 sigma. */
function excursionOf(error, sigma) {
  const result = {longest: 0, start: 0, outside: 0};
  let begin = -1;
  for (let i = 0; i <= error.length; i++) {
    if (i < error.length && sigma[i] > 0 && Math.abs(error[i]) > 3 * sigma[i]) {
      if (begin < 0) begin = i;
      result.outside++;
    } else if (begin >= 0) {
      if (i - begin > result.longest) Object.assign(result, {longest: i - begin, start: begin});
      begin = -1;
    }
  }
  return result;
}

/** The element whose error was outside 3 sigma for the longest time; empty if there is none. */
function excursionText(e) {
  if (verdictOf(e).cls === 'bad') return [];
  const times = columnOf(e.t);
  let worst = null;
  for (const block of e.blocks)
    block.error.forEach((ref, k) => {
      if (block.sigma[k] === undefined) return;
      const found = excursionOf(columnOf(ref), columnOf(block.sigma[k]));
      const share = found.outside / times.length;
      if (found.longest < 5 || share <= 0.02 || (worst && found.longest <= worst.longest)) return;
      worst = {...found, share, name: [block.name, block.tangent[k]].filter(Boolean).join('.')};
    });
  if (!worst) return [];
  const text = [
    `The error of ${worst.name} is outside 3σ at ${plural(worst.outside, 'timestamp')} `,
    `(${percent(worst.share)}, 0.3 % expected), for the longest time from `,
    timeLink(times[worst.start]),
    ' to ',
    timeLink(times[worst.start + worst.longest - 1]),
    '. ',
  ];
  return [text];
}

const norm = (columns, i) => Math.sqrt(sum(columns.map((column) => column[i] * column[i])));

/** The largest sudden decrease of the position sigma: a loop was closed, or a first fix came. */
function fixText(e) {
  const block = e.blocks.find((b) => b.name === e.position);
  if (!block || !block.sigma.length || e.smoothed) return [];
  const times = columnOf(e.t);
  const sigma = block.sigma.map(columnOf);
  const error = block.error.map(columnOf);
  let best = 0.5;
  let index = -1;
  for (let i = Math.max(1, Math.floor(times.length * 0.1)); i < times.length; i++) {
    const ratio = norm(sigma, i) / norm(sigma, i - 1);
    if (ratio < best) [best, index] = [ratio, i];
  }
  if (index < 0) return [];
  const fall = (columns) =>
    `from ${withUnit(norm(columns, index - 1), 'm')} to ${withUnit(norm(columns, index), 'm')}`;
  const errors = error.length ? `, and the error ${fall(error)}` : '';
  const text = ` (a loop closure or a first fix) the position σ fell ${fall(sigma)}${errors}. `;
  return [['At ', timeLink(times[index]), text]];
}

/** Errors of the best estimator in each segment of the config. */
function segmentItem(add) {
  const [best] = rankedEstimators();
  const block = mainBlock();
  if (!best) return;
  const error = (segment) => best.metrics[`rmse:${block.name}@${segment.name}`];
  const segments = RUN.segments.filter((s) => error(s) > 0 && s.spans.length);
  if (!segments.length) return;
  const texts = segments.map((s, i) => [
    i ? '; ' : '',
    `${s.name} (${s.rule}) ${withUnit(error(s), block.error_unit)} RMSE`,
    longestSpan(s),
  ]);
  add('calm', '▒', [nameOf(best.name), ': ', texts, '.']);
}

function longestSpan(segment) {
  const [from, to] = segment.spans.reduce((p, q) => (q[1] - q[0] > p[1] - p[0] ? q : p));
  const word = segment.spans.length > 1 ? ', longest from ' : ' from ';
  return [word, timeLink(from), ' to ', timeLink(to)];
}

/** Position error at the end, compared with the length of the true path. */
function driftItem(add) {
  const e = RUN.estimators.find((q) => q.position);
  const block = e && e.blocks.find((b) => b.name === e.position);
  if (!block || !block.error.length) return;
  const truth = block.elements.map((name) => truthOf(block, name));
  let path = 0;
  for (let i = 1; truth[0] && i < truth[0].length; i++) {
    const step = Math.hypot(...truth.map((c) => c[i] - c[i - 1]));
    if (Number.isFinite(step)) path += step;
  }
  if (!(path > 0)) return;
  const key = 'final_error:' + block.name;
  const errors = RUN.estimators
    .filter((q) => Number.isFinite(q.metrics[key]))
    .map((q, i) => {
      const share = (100 * q.metrics[key]) / path;
      const text = ` ${withUnit(q.metrics[key], 'm')} (${numberText(share, 2)} %)`;
      return [i ? ', ' : '', nameOf(q.name), text];
    });
  if (!errors.length) return;
  add('calm', '↝', [`Path of ${withUnit(path, 'm')}; position error at its end `, errors, '.']);
}

/** Errors of the landmarks in the final state. */
function landmarkErrors(e) {
  const map = mapColumns(e);
  const errors = [];
  let outside = 0;
  for (let i = 0; i < map.x.length; i++) {
    const error = Math.hypot(map.x[i] - map.tx[i], map.y[i] - map.ty[i], map.z[i] - map.tz[i]);
    if (!Number.isFinite(error) || map.removed_s[i] >= 0) continue;
    errors.push(error);
    if (error > 3 * Math.hypot(map.sx[i], map.sy[i], map.sz[i])) outside++;
  }
  return {errors: errors.sort((a, b) => b - a), outside};
}

/** RMSE of a map, and how much of it the worst tenth of the landmarks causes. */
function mapText(errors) {
  const square = (list) => sum(list.map((v) => v * v));
  const few = Math.max(1, Math.floor(errors.length * 0.1));
  const share = square(errors.slice(0, few)) / square(errors);
  const remaining = Math.sqrt(square(errors.slice(few)) / (errors.length - few));
  const rmse = Math.sqrt(square(errors) / errors.length);
  const median = errors[Math.floor(errors.length / 2)];
  const text = ` median error ${withUnit(median, 'm')}, RMSE ${withUnit(rmse, 'm')}`;
  if (share <= 0.8) return text;
  const worst = few > 1 ? `the worst ${few}` : 'the worst one';
  return `${text} (${withUnit(remaining, 'm')} without ${worst})`;
}

function mapItem(add) {
  const maps = RUN.estimators
    .filter((e) => e.landmarks)
    .map((e) => ({name: e.name, ...landmarkErrors(e)}))
    .filter((map) => map.errors.length >= 5);
  if (!maps.length) return;
  const size = Math.max(...maps.map((map) => map.errors.length));
  const outside = maps
    .filter((map) => map.outside)
    .map((map) => `${map.name}: ${map.outside} of ${map.errors.length} are more than 3σ off.`);
  add(
    'calm',
    '∴',
    [
      `Map of ${plural(size, 'landmark')}: `,
      maps.map((map, i) => [i ? '; ' : '', nameOf(map.name), mapText(map.errors)]),
      '.',
    ],
    outside.join(' ') || 'None is more than 3σ off.',
  );
}
