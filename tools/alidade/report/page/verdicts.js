// SPDX-License-Identifier: Apache-2.0
// Verdicts: how the page shows the verdict that the program computed for an estimator.

/** Class and sign of each state. */
const VERDICTS = {
  failed: ['bad', '✕'],
  diverged: ['bad', '✕'],
  lost: ['bad', '✕'],
  'mostly rejected': ['bad', '⊘'],
  overconfident: ['warn', '▲'],
  underconfident: ['warn', '▼'],
  consistent: ['good', '✓'],
  'not tested': ['calm', '?'],
};

/** {state, because, since, cls, mark} of an estimator; since: seconds after the start, or null. */
function verdictOf(e) {
  const {state, because, since_s: since} = e.verdict;
  const [cls, mark] = VERDICTS[state] || VERDICTS['not tested'];
  return {state, because, since: since === null ? null : since - RUN.t0, cls, mark};
}
