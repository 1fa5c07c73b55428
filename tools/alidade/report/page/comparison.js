// SPDX-License-Identifier: Apache-2.0
// Section "Comparison" of estimators on the same data.

/** The blocks with an RMSE. */
const comparedBlocks = () =>
  unique(
    COMPARISON.estimators
      .flatMap((e) => Object.keys(e.values))
      .filter((key) => /^rmse:[^@]*$/.test(key))
      .map((key) => key.slice(5)),
  );

const unitOfBlock = (block) => {
  const e = COMPARISON.estimators.find((q) => q.units && q.units[block] !== undefined);
  return e ? e.units[block] : '';
};

/** The mean of a value of an estimator; NaN if it is unknown. */
const comparedValue = (e, key) => (e.values[key] ? e.values[key][0] : NaN);

/** A row of buttons that selects a block. `build(block, figures)` fills the section. */
function blockChoice(blocks, build) {
  const holder = element('div');
  let plots = [];
  const show = (block) => {
    dispose(plots);
    plots = [];
    setContent(holder);
    build(block, holder, (parent, spec) => {
      plots.push(...spec.plots);
      figure(parent, spec);
    });
  };
  const items = blocks.map((block) => [block, shortName(block)]);
  const buttons = element('div', {class: 'side'}, choice('', items, blocks[0], show));
  show(blocks[0]);
  return [buttons, holder];
}

function notesFold(parent) {
  const {notes} = COMPARISON;
  if (!notes.length) return;
  fold(parent, 'Notes', plural(notes.length, 'note'), (box) => {
    const items = notes.map((note) => element('li', {}, note));
    box.append(element('ul', {class: 'panel quiet'}, items));
  });
}

function compareSection(main) {
  const hasIntervals = COMPARISON.runs > 1;
  const subtitle = hasIntervals
    ? `${COMPARISON.runs} runs; intervals are 95 %`
    : 'one run: no intervals, --runs N computes them';
  const box = section('comparison', 'Comparison', subtitle, main);
  const blocks = comparedBlocks();
  if (blocks.length)
    box.append(
      ...blockChoice(blocks, (block, holder, put) => {
        const grid = element('div', {class: 'cols'});
        holder.append(grid);
        for (const spec of [decompositionFigure(block), ratioFigure(block), costFigure(block)])
          if (spec) put(grid, spec);
        const overTime = overTimeFigure(block);
        if (overTime) put(holder, overTime);
        holder.append(element('div', {class: 'panel'}, comparisonTable(block)));
      }),
    );
  notesFold(box);
}
