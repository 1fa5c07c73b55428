// SPDX-License-Identifier: Apache-2.0
// Section "Events".

function eventSection(main) {
  const rows = RUN.estimators
    .flatMap((e) => e.events.map(([t, kind, text]) => ({e, t, kind, text})))
    .sort((a, b) => (a.t === null ? -1 : a.t) - (b.t === null ? -1 : b.t));
  const s = section('events', 'Events', plural(rows.length, 'event'), main);
  if (!rows.length) {
    s.append(
      element(
        'p',
        {class: 'panel quiet'},
        'Nothing was reported: no divergence, no reset, no bound left.',
      ),
    );
    return;
  }
  s.append(
    element(
      'div',
      {class: 'panel'},
      dataTable(
        [
          {
            name: 'time',
            get: (r) => (r.t === null ? -1 : r.t),
            show: (r) => (r.t === null ? 'whole run' : timeLink(r.t)),
          },
          {name: 'estimator', text: true, get: (r) => r.e.name, show: (r) => nameOf(r.e.name)},
          {name: 'kind', text: true, get: (r) => r.kind.replace(/_/g, ' ')},
          {name: 'what', text: true, wrap: true, get: (r) => r.text},
        ],
        rows,
        {off: (r) => page.hidden.has(r.e.name), tall: true},
      ),
    ),
  );
}
