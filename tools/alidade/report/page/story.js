// SPDX-License-Identifier: Apache-2.0
// Section "What happened". Verdicts, findings and events are the program's own sentences.

/** The items of the list: {cls, mark, text, more}. */
function story() {
  const items = [];
  const add = (cls, mark, text, more) => items.push({cls, mark, text, more});
  if (DATA.status !== 'ok') {
    const word = DATA.status === 'failed' ? 'failed' : 'was stopped';
    const end = `at ${clock(page.full[1])} s, after ${plural(DATA.frames || 0, 'frame')}`;
    add('bad', '✕', [`The run ${word} ${end}.`]);
  }
  consistentItem(add);
  for (const group of similarEstimators()) estimatorItem(group, add);
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
  const notes = [...findingTexts(e, because), ...eventTexts(e)];
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

/** The findings, except that of the verdict. */
const findingTexts = (e, because) =>
  (e.diagnosis || [])
    .filter((finding) => finding.text !== because)
    .map((finding) => sentence(finding.text) + ' ');

/** Kinds of events whose content a verdict reports. */
const VERDICT_KINDS = /^(diverged|lost|mostly_rejected)$/;

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
