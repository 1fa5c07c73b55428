// SPDX-License-Identifier: Apache-2.0
// Text of a table as Markdown or LaTeX.

/** Texts of the cells, row by row; the first row contains the names of the columns. */
function tableTexts({columns, rows}) {
  const textOf = (content) => (content instanceof Node ? content.textContent : content ?? '');
  const names = columns.map(({name, sub}) => (sub ? `${name} ${sub}` : name));
  const cellText = (column, row) => String(textOf(cellContent(column, row)));
  return [names, ...rows.map((row) => columns.map((column) => cellText(column, row)))];
}

function markdownText(table) {
  const [names, ...rows] = tableTexts(table);
  const line = (cells) => `| ${cells.join(' | ')} |\n`;
  return [names, names.map(() => '---'), ...rows].map(line).join('');
}

function latexText(table) {
  const escaped = (text) =>
    text
      .replace(/[▲▼✓✕]/g, '')
      .replace(/[_%&#]/g, '\\$&')
      .replace(/−/g, '$-$');
  const lines = tableTexts(table).map((cells) => cells.map(escaped).join(' & ') + ' \\\\\n');
  const format = 'l' + 'r'.repeat(table.columns.length - 1);
  return `\\begin{tabular}{${format}}\n${lines.join('')}\\end{tabular}\n`;
}
