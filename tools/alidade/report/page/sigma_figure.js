// SPDX-License-Identifier: Apache-2.0
// Figures of the standard deviations over time.

/** The names of the blocks that have standard deviations in some estimator. */
const sigmaBlocks = () =>
  unique(
    RUN.estimators
      .flatMap((e) => e.blocks)
      .filter((block) => block.sigma.length)
      .map((block) => block.name),
  );

/** The standard deviations of a block: a plot for each tangent element. */
function sigmaFigure(name) {
  const users = RUN.estimators
    .map((e) => ({e, block: e.blocks.find((b) => b.name === name && b.sigma.length)}))
    .filter(({block}) => block);
  const {tangent, sigma, error_unit: unit} = users[0].block;
  const plots = sigma.map((_, k) => {
    const isLast = k === sigma.length - 1;
    const lines = () =>
      users
        .filter(({block}) => block.sigma[k] !== undefined)
        .map(({e, block}) => ({
          kind: 'line',
          x: columnOf(e.t),
          y: columnOf(block.sigma[k]),
          est: e.name,
          name: e.name,
        }));
    return new Plot({
      label: `σ of ${shortName(name)} ${tangent[k] || ''}`.trim(),
      time: true,
      last: isLast,
      height: isLast ? 128 : 100,
      y: {unit, log: true},
      layers: lines,
    });
  });
  return {title: name.replace('.', ' · '), plots};
}
