// SPDX-License-Identifier: Apache-2.0
// Section "Inside the filter": standard deviations, gains, correlations, frame time.

function insideSection(main) {
  const box = section('inside', 'Inside the filter', 'drawn when opened', main);
  const blocks = sigmaBlocks();
  if (blocks.length)
    fold(box, 'Standard deviations', 'of every block, logarithmic', (parent) => {
      for (const block of blocks) figure(parent, sigmaFigure(block));
    });
  const sensors = gainSensors();
  if (sensors.length)
    fold(box, 'Gain', 'change of the estimate per unit of the innovation', (parent) => {
      for (const sensor of sensors) figure(parent, gainFigure(sensor));
    });
  const correlated = RUN.estimators.filter((e) => e.last_p && e.last_p.labels.length > 1);
  if (correlated.length)
    fold(box, 'Correlations at the end', 'of the last P', (parent) =>
      correlationFigures(parent, correlated),
    );
  const subtitle = 'not in this file, so that its bytes are reproducible';
  fold(box, 'Frame time', subtitle, frameTimePanel);
}
