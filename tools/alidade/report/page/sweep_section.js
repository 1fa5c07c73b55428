// SPDX-License-Identifier: Apache-2.0
// Section "Runs" of a sweep.

/** A list of metrics to select from. */
function metricSelect(label, selected, change) {
  const options = SWEEP.metrics.map((metric) =>
    element('option', {value: metric, selected: metric === selected}, metric),
  );
  const onchange = (event) => change(event.target.value);
  return element(
    'label',
    {class: 'group'},
    element('span', {class: 'label'}, label),
    element('select', {class: 'btn', onchange}, options),
  );
}

function sweepSection(main) {
  const {metrics, groups, vary} = SWEEP;
  const box = section('runs', 'Runs', `${SWEEP.runs} seeds from ${SWEEP.first_seed}`, main);
  const holder = element('div');
  const selected = {
    metric: SWEEP.main_metric || metrics[0],
    second: metrics.find((metric) => /^nees\.mean/.test(metric)) || metrics[1] || metrics[0],
    shape: 'histogram',
    value: vary ? groups[0].value : null,
  };
  let plots = [];
  const set = (key) => (value) => {
    selected[key] = value;
    build();
  };
  const put = (parent, spec) => {
    plots.push(...spec.plots);
    figure(parent, spec);
  };
  function build() {
    dispose(plots);
    plots = [];
    const {metric, second, shape, value} = selected;
    const own = groups.filter((g) => valuesOf(g, metric).length && (!vary || g.value === value));
    const grid = element('div', {class: 'cols'});
    setContent(holder);
    put(holder, seedFigure(own, metric));
    holder.append(grid);
    const shapes = [
      ['histogram', 'histogram'],
      ['ecdf', 'ECDF'],
    ];
    const shapeChoice = choice('', shapes, shape, set('shape'));
    put(grid, distributionFigure(own, metric, shape, shapeChoice));
    const against = metricSelect('against', second, set('second'));
    put(grid, twoMetricFigure(own, metric, second, against));
    const worst = worstRunTable(own, metric);
    if (worst) holder.append(worst);
  }
  const values = variedValues().map(({value, label}) => [value, label]);
  box.append(
    element(
      'div',
      {class: 'side'},
      metricSelect('metric', selected.metric, set('metric')),
      vary && choice(vary, values, selected.value, set('value')),
    ),
    holder,
  );
  build();
}
