// SPDX-License-Identifier: Apache-2.0
// Section "Events".

function eventSection(main) {
  const timeOf = ({time}) => (time === null ? -1 : time);
  const rows = RUN.estimators
    .flatMap((e) => e.events.map(([time, kind, text]) => ({e, time, kind, text})))
    .sort((a, b) => timeOf(a) - timeOf(b));
  const box = section('events', 'Events', plural(rows.length, 'event'), main);
  if (!rows.length) {
    const text = 'Nothing was reported: no divergence, no reset, no bound left.';
    box.append(element('p', {class: 'panel quiet'}, text));
    return;
  }
  const timeCell = ({time}) => (time === null ? 'whole run' : timeLink(time));
  const columns = [
    {name: 'time', get: timeOf, show: timeCell},
    {name: 'estimator', text: true, get: ({e}) => e.name, show: ({e}) => nameOf(e.name)},
    {name: 'kind', text: true, get: ({kind}) => kind.replace(/_/g, ' ')},
    {name: 'what', text: true, wrap: true, get: ({text}) => text},
  ];
  const table = dataTable(columns, rows, {off: ({e}) => page.hidden.has(e.name), tall: true});
  box.append(element('div', {class: 'panel'}, table));
}
