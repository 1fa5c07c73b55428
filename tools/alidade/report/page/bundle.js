// SPDX-License-Identifier: Apache-2.0
// Section "Adjustment" of a bundle adjustment.

function bundleSection(main) {
  const box = section('bundle', 'Adjustment', '', main);
  const rows = Object.entries(DATA.bundle).filter(
    ([, value]) => typeof value === 'number' || (typeof value === 'string' && value),
  );
  const columns = [
    {name: 'quantity', text: true, get: ([key]) => key.replace(/_/g, ' ')},
    {
      name: 'value',
      get: ([, value]) => (typeof value === 'number' ? value : NaN),
      show: ([, value]) => (typeof value === 'number' ? numberText(value, 5) : value),
    },
  ];
  box.append(element('div', {class: 'panel'}, dataTable(columns, rows)));
}
