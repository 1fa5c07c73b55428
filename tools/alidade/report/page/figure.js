// SPDX-License-Identifier: Apache-2.0
// Figure: a title, a hint, plots, and the menu that saves them.

/** A figure: title, what a good one looks like, plots, and the menu that saves them. */
function figure(parent, {title, hint, plots, controls, className}) {
  const note = element('p', {class: 'note', hidden: true});
  for (const plot of plots) plot.onPainted = () => showLost(plots, note);
  const elements = plots.map((plot) => plot.el);
  const side = element('div', {class: 'side'}, controls, fitButton(plots), saveMenu(title, plots));
  const panel = element(
    'figure',
    {class: 'panel ' + (className || '')},
    element('header', {}, element('h3', {}, title), side),
    hint && element('p', {class: 'hint'}, hint),
    className === 'maps' ? element('div', {class: 'pair'}, elements) : elements,
    plots.flatMap((plot) => plot.extra || []),
    note,
  );
  parent.append(panel);
  return panel;
}

/** The button that scales the axes to all values, if the axes of a plot may omit some. */
function fitButton(plots) {
  const isFitted = ({spec}) => spec.time && !spec.y.range && !spec.noFit;
  if (!plots.some(isFitted)) return null;
  const onclick = (event) => {
    const full = !plots[0].full;
    for (const plot of plots) plot.full = full;
    event.target.setAttribute('aria-pressed', full);
    redraw();
  };
  const title = 'scale the axes to all values, or to those that matter';
  const attributes = {class: 'btn small', 'aria-pressed': 'false', title, onclick};
  return element('button', attributes, 'fit all');
}

/** Names the curves that leave the axes. */
function showLost(plots, note) {
  const lost = unique(plots.flatMap((plot) => [...(plot.lost || [])]));
  note.hidden = !lost.length || plots[0].full;
  const verb = lost.length > 1 ? 'leave' : 'leaves';
  note.textContent = `${list(lost)} ${verb} the axis: "fit all" shows everything.`;
}
