// SPDX-License-Identifier: Apache-2.0
// Section "Adjustment" of a bundle adjustment.

function bundleSection(main) {
  const box = section('bundle', 'Adjustment', '', main);
  const rows = Object.entries(DATA.bundle).filter(
    ([, value]) => typeof value === 'number' || (typeof value === 'string' && value),
  );
  const textOf = (value) => {
    if (typeof value !== 'number') return value;
    return Number.isInteger(value) ? count(value) : numberText(value, 5);
  };
  const columns = [
    {name: 'quantity', text: true, get: ([key]) => key.replace(/_/g, ' ')},
    {name: 'value', get: ([, value]) => Number(value), show: ([, value]) => textOf(value)},
  ];
  box.append(element('div', {class: 'panel'}, dataTable(columns, rows)));
}
