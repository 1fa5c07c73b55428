# SPDX-License-Identifier: Apache-2.0
"""Tests of alidade.Run, Sweep and Comparison. Cells are compared with those of Python's csv."""
import csv
import json
import shutil
import sys
import unittest
from unittest import mock

try:
    import numpy as np
except ImportError:
    raise unittest.SkipTest("the package numpy is not installed") from None

from folders import NAMES, STREAM, Folders

import alidade


class ReaderTest(Folders):
    def setUp(self):
        self.run_folder = alidade.Run(self.root / "run")
        self.ekf = self.run_folder["_ekf"]

    def copy(self, name):
        """Returns a copy of the run folder, which the test may change."""
        folder = self.root / name
        shutil.copytree(self.root / "run", folder)
        return folder

    def fails(self, text, function, *arguments):
        """Expects an error that contains the text."""
        with self.assertRaises(alidade.AlidadeError) as caught:
            function(*arguments)
        self.assertIn(text, str(caught.exception))

    def test_columns_are_those_of_the_file(self):
        with open(self.root / "run/_ekf/estimates.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        table = self.ekf.estimates
        self.assertEqual(list(table), list(rows[0]))
        for name in table:
            np.testing.assert_array_equal(table[name], [float(row[name]) for row in rows])
        self.assertEqual(table.units["target.depth_rate"], "m/s")

    def test_text_is_not_read_as_a_number(self):
        table = self.ekf.innovations
        self.assertEqual(set(table["sensor"]), {"nan"})
        self.assertEqual(set(table["stream"]), {STREAM})
        self.assertEqual(set(table["outcome"]), {"accepted", "gated"})
        self.assertEqual(table["nis"].dtype, float)

    def test_an_empty_cell_is_nan_or_an_empty_text(self):
        path = self.root / "table.csv"
        path.write_text('t_s,text\n,"a ""b"",\nc"\n1,\n')
        columns = [{"name": "t_s", "quantity": "t_s"}, {"name": "text", "quantity": "text"}]
        table = alidade.Table(path, columns)
        np.testing.assert_array_equal(table["t_s"], [np.nan, 1])
        self.assertEqual(list(table["text"]), ['a "b",\nc', ""])

    def test_estimators_have_the_order_of_the_config(self):
        self.assertEqual(list(self.run_folder), NAMES)
        self.assertEqual(alidade.Sweep(self.root / "sweep").estimators, NAMES)
        self.assertEqual(list(alidade.Comparison(self.root / "compare").estimators), NAMES)

    def test_verdict_and_metrics_are_those_of_run_json(self):
        info = json.loads((self.root / "run/run.json").read_text())
        self.assertEqual(self.run_folder.verdict, info["verdict"])
        self.assertEqual(self.ekf.metrics, info["estimators"]["_ekf"]["metrics"])
        self.assertEqual(self.ekf.verdict, info["estimators"]["_ekf"]["verdict"]["state"])

    def test_a_block_is_an_array_with_a_column_for_each_element(self):
        table = self.ekf.estimates
        columns = [dict(c, subject="target") for c in table.columns]
        block = alidade.Table(table.path, columns)["sigma:target"]
        expected = [table["sigma:target.depth"], table["sigma:target.depth_rate"]]
        np.testing.assert_array_equal(block, np.column_stack(expected))

    def test_variances_of_the_covariance_are_those_of_the_estimates(self):
        p = self.ekf.covariance
        np.testing.assert_array_equal(p, p.transpose(0, 2, 1))
        sigma = self.ekf.estimates["sigma:target.depth_rate"]
        np.testing.assert_allclose(np.sqrt(p[:, 1, 1]), sigma, rtol=1e-12)

    def test_an_unknown_name_is_an_error_with_near_names(self):
        self.fails("expected target.depth", self.ekf.estimates.__getitem__, "target.dept")
        self.fails("expected _ekf", self.run_folder.__getitem__, "ekf")
        with self.assertRaises(KeyError):
            self.ekf.estimates["depth"]
        self.assertNotIn("depth", self.ekf.estimates)

    def test_another_folder_is_an_error(self):
        self.fails("this folder does not exist", alidade.Run, self.root / "none")
        self.fails("this is not a folder of alidade", alidade.Run, self.root)
        self.fails("this is a folder of `alidade sweep`", alidade.Run, self.root / "sweep")
        self.fails("expected a folder of `alidade sweep`", alidade.Sweep, self.root / "run")

    def test_a_run_without_results_is_an_error(self):
        folder = self.copy("unfinished")
        (folder / "run.json").write_text('{"status": "running"}')
        self.fails("its status is 'running'", alidade.Run, folder)

    def test_a_file_is_read_when_it_is_used(self):
        folder = self.copy("missing")
        (folder / "_ekf/errors.csv").unlink()
        run = alidade.Run(folder)
        self.fails("errors.csv: this file does not exist", run["_ekf"].errors.__getitem__, "t_s")
        self.assertTrue(len(run["1e5"].errors["t_s"]))

    def test_an_incomplete_last_row_is_ignored(self):
        folder = self.copy("killed")
        with open(folder / "_ekf/errors.csv", "a") as file:
            file.write("9.9,0.1")
        table = alidade.Run(folder)["_ekf"].errors
        np.testing.assert_array_equal(table["t_s"], self.ekf.errors["t_s"])

    def test_a_damaged_file_is_an_error(self):
        folder = self.copy("damaged")
        with open(folder / "_ekf/errors.csv", "a") as file:
            file.write("9.9,0.1\n")
        self.fails("has 2 cells; expected 6", alidade.Run(folder)["_ekf"].errors.__getitem__, "t_s")
        path = folder / "_ekf/estimates.csv"
        path.write_text(path.read_text().replace("0.000000000,", "zero,", 1))
        self.fails("'zero'", alidade.Run(folder)["_ekf"].estimates.__getitem__, "t_s")

    def test_a_frame_needs_pandas(self):
        with mock.patch.dict(sys.modules, {"pandas": None}):
            self.fails("the package pandas", self.ekf.errors.frame)

    def test_a_sweep_has_runs_and_values(self):
        sweep = alidade.Sweep(self.root / "sweep")
        self.assertIsNone(sweep.vary)
        used = sweep.runs["estimator"] == "_ekf"
        summary = sweep.values[""]["_ekf"]["metrics"]["rmse:target.depth"]
        self.assertAlmostEqual(sweep.runs["rmse:target.depth"][used].mean(), summary["mean"])
        vary = alidade.Sweep(self.root / "vary")
        self.assertEqual((vary.vary, list(vary.values)), ("source.duration_s", ["1", "2", "3"]))


if __name__ == "__main__":
    unittest.main()
