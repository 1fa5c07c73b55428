// SPDX-License-Identifier: Apache-2.0
// Table whose rows are sorted by a click on a column.

/**
 * A table. columns: {name, sub, title, text, wrap, best, get(row), show(row)}.
 *
 *   get(row)   number or text that sorts the rows
 *   show(row)  content of the cell; default: the formatted number
 *   text       true: the column contains texts
 *   best       `min`: the least positive number of the column is bold
 *
 * Rows for which off(row) is true are grey. `tall` tables scroll.
 */
class Table {
  constructor(columns, rows, {off = () => false, tall} = {}) {
    Object.assign(this, {columns, rows, off, sorted: null, ascending: true});
    this.least = columns.map((column) => (column.best ? this.leastOf(column) : null));
    this.heads = columns.map((column, i) => this.headCell(column, i));
    this.body = element('tbody');
    const head = element('thead', {}, element('tr', {}, this.heads));
    const table = element('table', {}, head, this.body);
    this.el = element('div', {class: 'scroll' + (tall ? ' tall' : '')}, table);
    this.fill();
  }

  /** The least positive number of a column; null: fewer than two numbers. */
  leastOf(column) {
    const values = this.rows.map(column.get).filter((v) => Number.isFinite(v) && v > 0);
    return values.length > 1 ? Math.min(...values) : null;
  }

  headCell(column, i) {
    const attributes = {
      class: column.text ? 'text' : '',
      'aria-sort': 'none',
      title: column.title,
      tabindex: 0,
      onclick: () => this.sort(i),
      onkeydown: ({key}) => {
        if (key === 'Enter') this.sort(i);
      },
    };
    return element('th', attributes, column.name, column.sub && element('small', {}, column.sub));
  }

  sort(i) {
    this.ascending = this.sorted === i ? !this.ascending : true;
    this.sorted = i;
    const order = this.ascending ? 'ascending' : 'descending';
    this.heads.forEach((head, k) => head.setAttribute('aria-sort', k === i ? order : 'none'));
    this.fill();
  }

  sortedRows() {
    if (this.sorted === null) return this.rows;
    const {get} = this.columns[this.sorted];
    const sign = this.ascending ? 1 : -1;
    return this.rows.slice().sort((a, b) => sign * compareValues(get(a), get(b)));
  }

  fill() {
    const rowOf = (row) =>
      element(
        'tr',
        {class: this.off(row) ? 'off' : ''},
        this.columns.map((column, i) => this.cell(column, i, row)),
      );
    setContent(this.body, this.sortedRows().map(rowOf));
  }

  cell(column, i, row) {
    const isBest = this.least[i] !== null && column.get(row) === this.least[i];
    const names = [column.text && 'text', column.wrap && 'wrap', isBest && 'best'];
    return element('td', {class: names.filter(Boolean).join(' ')}, cellContent(column, row));
  }
}

const dataTable = (columns, rows, options) => new Table(columns, rows, options).el;

function cellContent({get, show}, row) {
  if (show) return show(row);
  const value = get(row);
  return typeof value === 'number' ? numberText(value) : value;
}

/** Order of texts or numbers; numbers that are not finite come last. */
function compareValues(a, b) {
  if (typeof a === 'string') return a.localeCompare(b);
  const [x, y] = [a, b].map((value) => (Number.isFinite(value) ? value : Number.MAX_VALUE));
  return x - y;
}
