// SPDX-License-Identifier: Apache-2.0
// Figure of the error decomposition: from the filter down to the error with all data.

const COST_COLOUR = '#E08A00';
const GAIN_COLOUR = '#56B4E9';

/**
 * Bars {name, from, to, isTotal} of the decomposition of the error of a block. Steps that are known
 * only at the last frame are omitted.
 */
function decompositionBars(block) {
  const {filter, steps} = COMPARISON.decomposition;
  const step = (kind) => steps.find((s) => s.kind === kind && !s.at_end);
  const error = (s, key) => (s && s.values[key + block] ? s.values[key + block][0] : undefined);
  const linearisation = step('linearisation');
  const smoothing = step('smoothing');
  const rejected = step('rejected_measurements');
  const own = error(linearisation, 'rmse.from:') || error(smoothing, 'rmse.from:');
  if (!own) return [];
  const total = (name, to) => ({name, from: 0, to, isTotal: true});
  const part = (name, from, to) => ({name, from, to, isTotal: false});
  const bars = [total(filter, own)];
  const full = error(linearisation, 'rmse.to:');
  if (full !== undefined)
    bars.push(part('linearised once', full, own), total('full information', full));
  const smoothed = error(smoothing, 'rmse.to:');
  if (smoothed !== undefined) {
    bars.push(part('no later data', smoothed, full === undefined ? own : full));
    bars.push(total(smoothing.to, smoothed));
  }
  const accepted = error(rejected, 'rmse.from:');
  if (accepted !== undefined)
    bars.push(part('rejected data', error(rejected, 'rmse.to:'), accepted));
  return bars;
}

function barColour({name, from, to, isTotal}) {
  if (!isTotal) return to >= from ? COST_COLOUR : GAIN_COLOUR;
  return NAMES.includes(name) ? colorOf(name) : colours.faint;
}

function paintBar(surface, X, y, bar, label) {
  const left = X.to(Math.min(bar.from, bar.to));
  const right = X.to(Math.max(bar.from, bar.to));
  const alpha = bar.isTotal ? 0.85 : 1;
  surface.rect(left, y - 9, Math.max(right - left, 1.5), 18, {fill: barColour(bar), alpha});
  surface.text(label, right + 6, y, {color: colours.ink, size: 11.5});
}

function decompositionFigure(block) {
  if (!COMPARISON.decomposition) return null;
  const bars = decompositionBars(block);
  if (!bars.length) return null;
  const unit = unitOfBlock(block);
  const [factor, label] = unitFor(unit, bars[0].to);
  const textOf = ({from, to, isTotal}) => {
    if (from === to) return 'nothing';
    const sign = isTotal ? '' : to > from ? '−' : '+';
    return `${sign}${numberText(Math.abs(to - from) * factor)} ${label}`;
  };
  const top = (innerWidth < 520 ? 1.7 : 1.34) * Math.max(...bars.map(({from, to}) => Math.max(from, to)));
  const paint = (surface, X, Y) =>
    bars.forEach((bar, i) => {
      const y = Y.to(bars.length - 1 - i);
      paintBar(surface, X, y, bar, textOf(bar));
      if (i + 1 === bars.length) return;
      const x = X.to(bar.isTotal ? bar.to : bar.from);
      surface.path([x, y + 9, x, y + 21], {stroke: colours.faint, dash: [2, 2]});
    });
  const plot = new Plot({
    label: 'RMSE',
    name: 'decomposition',
    height: bars.length * 30 + 54,
    left: innerWidth < 520 ? 104 : 140,
    x: {label: 'RMSE', unit, range: () => [0, top]},
    y: {
      unit: '',
      rows: bars.map(({name}) => name).reverse(),
      range: () => [-0.6, bars.length - 0.4],
    },
    values: () => bars.map(({name, from, to}) => ({name, x: [Math.abs(to - from)], y: [0]})),
    layers: () => [{kind: 'custom', x: null, paint}],
  });
  return {
    title: `Error decomposition of ${COMPARISON.decomposition.filter}`,
    hint:
      'From the filter down to the error with all data. Orange: the error that a better method ' +
      'would remove. Blue: the error that it would add.',
    plots: [plot],
  };
}
