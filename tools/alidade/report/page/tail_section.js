// SPDX-License-Identifier: Apache-2.0
// Section "Configuration and files" at the end of the page.

/** Terms and keys, and their meanings. */
const GLOSSARY = [
  [
    'NEES',
    "normalised estimation error squared, e' P⁻¹ e / dof. The mean is 1 if the covariance P " +
      'is correct. It needs truth.',
  ],
  [
    'NIS',
    "normalised innovation squared, r' S⁻¹ r / dof: the same for measurements, without truth.",
  ],
  ['gate', 'measurements beyond this NIS are rejected.'],
  [
    'overconfident',
    'NEES above its bounds: the errors are larger than σ. This is dangerous if other programs ' +
      'rely on σ.',
  ],
  ['underconfident', 'NEES below its bounds: σ is larger than necessary.'],
  ['lost', 'the error was beyond 10 σ for 20 frames in a row.'],
  ['RMSE', 'root of the mean squared error over the frames.'],
  [
    'full information',
    'the best possible online estimate: at each frame a batch of all data up to this frame.',
  ],
  [
    'mouse',
    'drag: zoom in time; shift-drag: move; ctrl-wheel: zoom; double-click: all; click: keep the ' +
      'cursor, which the map follows.',
  ],
  [
    'keys',
    '1 to 9: estimators; on a plot: arrows move the cursor, shift-arrows the window, + and − ' +
      'zoom, 0 shows all.',
  ],
];

function configFold(parent) {
  if (!DATA.config) return;
  const subtitle = `${DATA.config.split('\n').length} lines; can be run as it is`;
  fold(parent, 'Resolved configuration', subtitle, (box) => {
    const onclick = () => save('config.resolved.yaml', 'text/yaml', DATA.config);
    const saveButton = element('button', {class: 'btn small', onclick}, 'save');
    const buttons = element('p', {class: 'side'}, copyButton(() => DATA.config), saveButton);
    box.append(element('div', {class: 'panel'}, buttons, element('pre', {}, DATA.config)));
  });
}

function fileFold(parent) {
  if (!DATA.files.length || DATA.live) return; // the server of a live page has no such files
  fold(parent, 'Files of this folder', plural(DATA.files.length, 'file'), (box) => {
    const links = DATA.files.map((file) => [element('a', {href: encodeURI(file)}, file), '  ']);
    box.append(element('p', {class: 'panel'}, links));
  });
}

function tailSections(main) {
  const box = section('config', 'Configuration and files', '', main);
  configFold(box);
  fileFold(box);
  fold(box, 'Words and keys', 'NEES, NIS, gate; the keyboard', (parent) => {
    const items = GLOSSARY.map(([term, text]) => [
      element('dt', {}, term),
      element('dd', {}, text),
    ]);
    parent.append(element('div', {class: 'panel'}, element('dl', {}, items)));
  });
}
