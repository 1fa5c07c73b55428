// SPDX-License-Identifier: Apache-2.0
// Section "Runs" of a sweep.

const DISTRIBUTIONS = [
  ['histogram', 'histogram'],
  ['ecdf', 'ECDF'],
];

/** A list of metrics to select from. */
function metricSelect(label, selected, change) {
  const options = SWEEP.metrics.map((metric) =>
    element('option', {value: metric, selected: metric === selected}, metricName(metric)),
  );
  const onchange = (event) => change(event.target.value);
  return element(
    'label',
    {class: 'group'},
    element('span', {class: 'label'}, label),
    element('select', {class: 'btn', onchange}, options),
  );
}

/** Figures of the selected metric, in place of those in `holder`. */
class SweepFigures {
  constructor(holder, selected) {
    Object.assign(this, {holder, selected, plots: []});
  }

  /** Returns a function that sets a choice. */
  set(key) {
    return (value) => {
      this.selected[key] = value;
      this.build();
    };
  }

  build() {
    dispose(this.plots);
    this.plots = [];
    setContent(this.holder);
    const {metric, second, shape, value} = this.selected;
    const groups = SWEEP.groups.filter(
      (group) => valuesOf(group, metric).length && (!SWEEP.vary || group.value === value),
    );
    const grid = element('div', {class: 'cols'});
    this.put(this.holder, seedFigure(groups, metric));
    this.holder.append(grid);
    const shapeChoice = choice('', DISTRIBUTIONS, shape, this.set('shape'));
    this.put(grid, distributionFigure(groups, metric, shape, shapeChoice));
    const against = metricSelect('against', second, this.set('second'));
    this.put(grid, twoMetricFigure(groups, metric, second, against));
    const worst = worstRunTable(groups, metric);
    if (worst) this.holder.append(worst);
  }

  put(parent, spec) {
    this.plots.push(...spec.plots);
    figure(parent, spec);
  }
}

function sweepSection(main) {
  const {metrics, groups, vary} = SWEEP;
  const box = section('runs', 'Runs', `${SWEEP.runs} seeds from ${SWEEP.first_seed}`, main);
  const selected = {
    metric: SWEEP.main_metric || metrics[0],
    second: metrics.find((metric) => /^nees\.mean/.test(metric)) || metrics[1] || metrics[0],
    shape: 'histogram',
    value: vary ? groups[0].value : null,
  };
  const holder = element('div');
  const figures = new SweepFigures(holder, selected);
  const values = variedValues().map(({value, label}) => [value, label]);
  const side = element(
    'div',
    {class: 'side'},
    metricSelect('metric', selected.metric, figures.set('metric')),
    vary && choice(vary, values, selected.value, figures.set('value')),
  );
  box.append(side, holder);
  figures.build();
}
