# SPDX-License-Identifier: Apache-2.0
"""Tests of metrics and tables."""
import json
import re
import unittest
from pathlib import Path

try:
    import numpy  # noqa: F401
except ImportError:
    raise unittest.SkipTest("the package numpy is not installed") from None

from folders import NAMES, Folders

from alidade import AlidadeError, metrics, tables

DOCS = Path(__file__).resolve().parents[2] / "docs"


def table(path, patterns=()):
    """Returns the rows of a table of all estimators, and its note."""
    names = {name: name for name in metrics.summaries(path)}
    return tables.rows_of(path, list(patterns), names)


class UnitsTest(unittest.TestCase):
    def test_units_are_those_of_the_page(self):
        """A unit of the page, such as `m`, `of the block` or empty, is that of UNITS."""
        text = (DOCS / "metrics.md").read_text()
        text = text.split("<!-- list: metrics -->")[1].split("<!-- end of list -->")[0]
        rows = [re.split(r"(?<!\\)\|", line) for line in text.splitlines() if "`" in line]
        self.assertGreater(len(rows), 30)
        for _, key, _, unit, *_ in rows:
            expected = {"of the block": "block", "0 to 1": ""}.get(unit.strip(), unit.strip())
            quantity = key.strip(" `").partition(":")[0]
            self.assertEqual(metrics.UNITS.get(quantity, ""), expected, key)

    def test_a_unit_belongs_to_a_block(self):
        units = {"target.depth": "m"}
        self.assertEqual(
            metrics.label_of("rmse:target.depth@blind", units), "rmse target.depth@blind [m]"
        )
        self.assertEqual(
            metrics.label_of("ratio.rmse:target.depth", units), "ratio.rmse target.depth"
        )


class TablesTest(Folders):
    def test_values_of_a_run_are_those_of_run_json(self):
        rows, note = table(self.root / "run", ["rmse:target.depth"])
        info = json.loads((self.root / "run/run.json").read_text())["estimators"]
        self.assertEqual(rows[0], ["estimator", "rmse target.depth [m]", "verdict"])
        self.assertEqual([row[0] for row in rows[1:]], NAMES)
        for name, value, verdict in rows[1:]:
            rmse = info[name]["metrics"]["rmse:target.depth"]
            self.assertAlmostEqual(float(value), rmse, delta=1e-3 * rmse)
            self.assertEqual(verdict, info[name]["verdict"]["state"])
        self.assertEqual(note, "")

    def test_brackets_have_one_meaning(self):
        rows, note = table(self.root / "sweep", ["rmse:target.depth"])
        self.assertRegex(rows[1][1], r"^\S+ \[\S+, \S+\]$")
        self.assertEqual(rows[0][1], "rmse target.depth [m]")
        self.assertEqual(note, metrics.MEAN)
        rows, note = table(self.root / "seeds", ["rmse:target.depth"])
        self.assertRegex(rows[1][1], r"^\S+ \(\S+, \S+\)$")
        self.assertEqual(note, metrics.SPREAD)

    def test_each_value_of_a_varied_sweep_has_a_row(self):
        rows, _ = table(self.root / "vary", ["nees.mean:*"])
        self.assertEqual(len(rows), 1 + 3 * len(NAMES))
        self.assertEqual(rows[1][0], "_ekf, source.duration_s = 1")

    def test_latex_shows_every_character(self):
        text = tables.latex([["a_b & $c$", r"\d{#%~^"]], "")
        self.assertIn(r"a\_b \& \$c\$", text)
        self.assertIn(r"\textbackslash{}d\{\#\%\textasciitilde{}\textasciicircum{}", text)

    def test_numbers_have_four_digits(self):
        for value, text in ((0.78, "0.7800"), (1234.4, "1234"), (0.0, "0"), (None, "not finite")):
            self.assertEqual(tables.number(value), text)

    def test_an_unknown_metric_is_an_error(self):
        with self.assertRaisesRegex(AlidadeError, "no metric matches rmse:nothing; there are"):
            table(self.root / "run", ["rmse:nothing"])


if __name__ == "__main__":
    unittest.main()
