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
  verdictItems(add);
  rankItem(add);
  findingItems(add);
  eventItems(add);
  for (const e of RUN.estimators) describeEstimator(e, add);
  segmentItem(add);
  driftItem(add);
  mapItem(add);
  return items;
}

/** Names of estimators, as a text in their colours. */
const namesOf = (names) =>
  names.map((name, i) => [i ? (i === names.length - 1 ? ' and ' : ', ') : '', nameOf(name)]);

/** One item for each state, the gravest first; it names all estimators in this state. */
function verdictItems(add) {
  const states = Object.keys(VERDICTS);
  for (const state of states) {
    const group = RUN.estimators.filter((e) => verdictOf(e).state === state);
    if (!group.length) continue;
    const {cls, mark} = verdictOf(group[0]);
    const verb = /^(failed|diverged)$/.test(state) ? ' ' : group.length > 1 ? ' are ' : ' is ';
    const word = state === 'not tested' ? 'not tested' : state;
    const reasons = group.map((e) => {
      const {because, since} = verdictOf(e);
      const name = group.length > 1 ? [nameOf(e.name), ': '] : '';
      return [name, because, since === null ? '' : [', from ', timeLink(since), ' on'], '. '];
    });
    add(cls, mark, [namesOf(group.map((e) => e.name)), verb, word, '.'], reasons);
  }
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
    'This is one seed; `alidade sweep --runs 100` shows whether the difference is chance.',
  );
}

/** Joins estimators that share a text: Map of text -> {names, first}. */
function groupByText(entries) {
  const groups = new Map();
  for (const {name, text, first} of entries) {
    if (!groups.has(text)) groups.set(text, {names: [], first});
    const {names} = groups.get(text);
    if (!names.includes(name)) names.push(name);
  }
  return groups;
}

const sentence = (text) => text + (/[.!?]$/.test(text) ? '' : '.');

function findingItems(add) {
  const entries = RUN.estimators.flatMap((e) =>
    (e.diagnosis || []).map((finding) => ({name: e.name, text: finding.text})),
  );
  for (const [text, {names}] of groupByText(entries))
    add('warn', '⚑', [namesOf(names), ': ', sentence(text)]);
}

/** Kinds of events whose content the verdicts already report. */
const REPORTED_KINDS = ['nees_bounds', 'nis_bounds'];

/** One item for each kind of event of each estimator: the first event, and their number. */
function eventItems(add) {
  const entries = RUN.estimators.flatMap((e) =>
    unique(e.events.map((event) => event[1]))
      .filter((kind) => !REPORTED_KINDS.includes(kind))
      .map((kind) => {
        const events = e.events.filter((event) => event[1] === kind);
        const more = events.length > 1 ? ` (first of ${events.length} such events)` : '';
        const [time, , text] = events[0];
        return {name: e.name, first: {time, kind, text, more}, text: `${kind} ${time} ${text}`};
      }),
  );
  for (const {names, first} of groupByText(entries).values()) {
    const grave = /^(diverged|lost|plugin_failed|not_pd|no_solution)$/.test(first.kind);
    const time = first.time === null ? '' : [' at ', timeLink(first.time)];
    const kind = first.kind.replace(/_/g, ' ');
    add(
      grave ? 'bad' : 'warn',
      grave ? '✕' : '!',
      [namesOf(names), ', ', kind, time, ': ', sentence(first.text), first.more],
    );
  }
}

/** Facts that are visible in the figures of an estimator. */
function describeEstimator(e, add) {
  const say = (cls, mark, ...text) => add(cls, mark, [nameOf(e.name), ': ', ...text, '.']);
  if (verdictOf(e).cls !== 'bad') describeExcursion(e, say);
  describeFix(e, say);
  describeGap(e, say);
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

/** The element whose error was outside 3 sigma for the longest time. */
function describeExcursion(e, say) {
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
  if (!worst) return;
  say(
    'warn',
    '↕',
    `the error of ${worst.name} is outside 3σ at ${plural(worst.outside, 'timestamp')} `,
    `(${percent(worst.share)}, 0.3 % expected), for the longest time from `,
    timeLink(times[worst.start]),
    ' to ',
    timeLink(times[worst.start + worst.longest - 1]),
  );
}

const norm = (columns, i) => Math.sqrt(sum(columns.map((column) => column[i] * column[i])));

/** The largest sudden decrease of the position sigma: a loop was closed, or a first fix came. */
function describeFix(e, say) {
  const block = e.blocks.find((b) => b.name === e.position);
  if (!block || !block.sigma.length || e.smoothed) return;
  const times = columnOf(e.t);
  const sigma = block.sigma.map(columnOf);
  const error = block.error.map(columnOf);
  let best = 0.5;
  let index = -1;
  for (let i = Math.max(1, Math.floor(times.length * 0.1)); i < times.length; i++) {
    const ratio = norm(sigma, i) / norm(sigma, i - 1);
    if (ratio < best) [best, index] = [ratio, i];
  }
  if (index < 0) return;
  const fall = (columns) =>
    `from ${withUnit(norm(columns, index - 1), 'm')} to ${withUnit(norm(columns, index), 'm')}`;
  say(
    'good',
    '⟲',
    'at ',
    timeLink(times[index]),
    ` (a loop closure or a first fix) the position σ fell ${fall(sigma)}`,
    error.length ? `, and the error ${fall(error)}` : '',
  );
}

/** The longest time without a measurement that was used. */
function describeGap(e, say) {
  const used = [];
  for (const innovation of e.innovations) {
    const times = columnOf(innovation.t);
    const outcomes = columnOf(innovation.outcome);
    const isCounted = innovation.landmark === undefined ? isUsed : isAccepted;
    for (let i = 0; i < times.length; i++) if (isCounted(outcomes[i])) used.push(times[i]);
  }
  if (!used.length || e.smoothed) return;
  used.sort((a, b) => a - b);
  used.push(page.full[1]);
  let longest = 0;
  let start = 0;
  let previous = page.full[0];
  for (const time of used) {
    if (time - previous > longest) [longest, start] = [time - previous, previous];
    previous = time;
  }
  if (longest <= 0.12 * (page.full[1] - page.full[0])) return;
  const end = start + longest;
  say(
    'warn',
    '…',
    'no measurement was used from ',
    timeLink(start),
    ' to ',
    timeLink(end),
    `: the filter predicted for ${numberText(longest)} s`,
  );
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
