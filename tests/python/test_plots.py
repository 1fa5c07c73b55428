# SPDX-License-Identifier: Apache-2.0
"""Tests of the figures: size, fonts, bytes, and texts that do not overlap."""
import json
import re
import shutil
import subprocess
import sys
import unittest
from unittest import mock

try:
    import matplotlib  # noqa: F401
    import numpy as np
except ImportError:
    raise unittest.SkipTest("the package matplotlib or numpy is not installed") from None

from folders import NAMES, Folders
from matplotlib.text import Text

import alidade
from alidade import plots
from alidade.plots.chi_square import quantile
from alidade.plots.options import Options
from alidade.plots.style import paper

FIGURES = [
    ("run", "state"),
    ("run", "errors"),
    ("run", "nis"),
    ("poses", "errors"),
    ("poses", "trajectory"),
    ("run", "comparison"),
    ("compare", "errors"),
    ("compare", "comparison"),
    ("seeds", "errors"),
    ("seeds", "nees"),
    ("seeds", "comparison"),
    ("sweep", "sweep"),
    ("sweep", "comparison"),
    ("vary", "sweep"),
]


def texts_of(figure):
    """Returns all drawn texts of a figure with their boxes in pixels."""
    drawn = []

    def draw(text, renderer):
        if text.get_visible() and text.get_text().strip():
            drawn.append((text.get_text(), text.get_window_extent(renderer)))

    with paper():
        figure.draw_without_rendering()  # places legend and panels
        with mock.patch.object(Text, "draw", draw):
            figure.draw(figure.canvas.get_renderer())
    return drawn


class PlotsTest(Folders):
    def figure(self, folder, plot, **options):
        return plots.figure(self.root / folder, plot, Options(**options))

    def expect_legible(self, figure, case):
        """Expects that texts are inside the figure and do not overlap."""
        texts = texts_of(figure)
        for i, (text, box) in enumerate(texts):
            self.assertGreaterEqual(box.x0, -1, f"{case}: {text!r}")
            self.assertLessEqual(box.x1, figure.bbox.width + 1, f"{case}: {text!r}")
            for other, second in texts[:i]:
                overlap = box.padded(-0.5).overlaps(second)
                self.assertFalse(overlap, f"{case}: {text!r}, {other!r}")

    def test_texts_do_not_overlap_and_are_inside(self):
        for folder, plot in FIGURES:
            for columns in (1, 2):
                figure = self.figure(folder, plot, columns=columns)
                self.expect_legible(figure, f"{folder} {plot} {columns}")

    def test_many_panels_need_two_columns(self):
        self.expect_legible(self.figure("poses", "state", columns=2), "poses state")
        with self.assertRaisesRegex(alidade.AlidadeError, "13 panels do not fit on a page"):
            self.figure("poses", "state", columns=1)

    def test_axes_are_labelled_with_units(self):
        axes = self.figure("run", "errors").axes
        self.assertEqual([a.get_ylabel() for a in axes], ["error [m]", "error [m/s]"])
        self.assertEqual(axes[-1].get_xlabel(), "time [s]")
        panel = self.figure("sweep", "sweep", metrics=["rmse:target.depth"]).axes[0]
        self.assertEqual(panel.get_xlabel(), "rmse target.depth [m]")

    def test_the_legend_shows_every_name(self):
        texts = [text for text, _ in texts_of(self.figure("run", "nis"))]
        for name in (*NAMES, "not accepted", "95 % bounds"):
            self.assertIn(name, texts)

    def test_labels_replace_names(self):
        figure = self.figure("run", "errors", estimators=["1e5", "_ekf"], labels=["$U$", "E"])
        legend = [text.get_text() for text in figure.legends[0].get_texts()]
        self.assertEqual(legend[:2], [r"\$U\$", "E"])
        with self.assertRaisesRegex(alidade.AlidadeError, "--labels has 1 names; expected 3"):
            self.figure("run", "errors", labels=["E"])

    def test_errors_are_those_of_the_file(self):
        line = self.figure("run", "errors", estimators=["_ekf"], start=1, end=2).axes[0].lines[-1]
        table = alidade.Run(self.root / "run")["_ekf"].errors
        rows = (table["t_s"] >= 1) & (table["t_s"] <= 2)
        np.testing.assert_array_equal(line.get_ydata(), table["target.depth"][rows])

    def test_rejected_measurements_are_marked(self):
        lines = self.figure("run", "nis", estimators=["_ekf"]).axes[0].lines
        marked = sum(len(line.get_xdata()) for line in lines if line.get_marker() == "x")
        table = alidade.Run(self.root / "run")["_ekf"].innovations
        self.assertEqual(marked, (table["outcome"] == "gated").sum())
        self.assertGreater(marked, 0)

    def test_blocks_are_selected(self):
        figure = self.figure("run", "state", blocks=["*.depth"])
        self.assertEqual([a.get_title(loc="left") for a in figure.axes], ["target.depth"])
        with self.assertRaisesRegex(alidade.AlidadeError, "nothing to draw"):
            self.figure("run", "state", blocks=["nothing"])

    def test_a_trajectory_has_the_axes_with_the_largest_range(self):
        axis = self.figure("poses", "trajectory").axes[0]
        position = alidade.Run(self.root / "poses")["ekf"].estimates["body.position"]
        np.testing.assert_array_equal(axis.lines[0].get_xydata(), position[:, 1:])
        self.assertEqual((axis.get_xlabel(), axis.get_ylabel()), ("y [m]", "z [m]"))
        self.assertEqual(axis.get_aspect(), 1)
        other = self.figure("poses", "trajectory", axes=["z", "x"]).axes[0]
        np.testing.assert_array_equal(other.lines[0].get_xydata(), position[:, [2, 0]])
        with self.assertRaisesRegex(alidade.AlidadeError, "expected two of x, y, z"):
            self.figure("poses", "trajectory", axes=["x", "w"])

    def test_ellipses_are_those_of_the_covariance(self):
        (ellipses,) = self.figure("poses", "trajectory", axes=["x", "y"]).axes[0].collections
        run = alidade.Run(self.root / "poses")["ekf"]
        variances = np.linalg.eigvalsh(run.covariance[0, :2, :2])
        lengths = sorted([2 * ellipses._heights[0], 2 * ellipses._widths[0]])
        np.testing.assert_allclose(lengths, 6 * np.sqrt(variances))

    def test_a_map_has_landmarks_with_ellipses(self):
        folder = self.root / "map"
        shutil.copytree(self.root / "poses", folder)
        (folder / "ekf/covariance.bin").unlink()
        names = "x y z sigma_x sigma_y sigma_z true_x true_y true_z cov_xy cov_xz cov_yz status"
        columns = json.loads((folder / "columns.json").read_text())
        columns["ekf/landmarks.csv"] = [{"name": n, "quantity": n} for n in names.split()]
        (folder / "columns.json").write_text(json.dumps(columns))
        header = names.replace(" ", ",")
        kept, removed = "3,4,5,0.1,0.3,0.2,,,,0,0,0,kept", "9,9,9,1,1,1,,,,0,0,0,removed"
        (folder / "ekf/landmarks.csv").write_text(f"{header}\n{kept}\n{removed}\n")
        axis = self.figure("map", "trajectory", axes=["x", "y"]).axes[0]
        np.testing.assert_array_equal(axis.lines[0].get_xydata(), [[3, 4]])
        (ellipses,) = axis.collections
        np.testing.assert_allclose(2 * ellipses._widths, 6 * 0.3)
        np.testing.assert_allclose(2 * ellipses._heights, 6 * 0.1)
        np.testing.assert_allclose(np.degrees(ellipses._angles) % 180, 90)

    def test_nees_of_a_run_has_the_mean_of_its_metric(self):
        axis = self.figure("run", "nees", estimators=["_ekf"], blocks=["target"]).axes[0]
        metrics = alidade.Run(self.root / "run")["_ekf"].metrics
        mean = np.nanmean(axis.lines[-1].get_ydata())
        # Values below the axis are drawn at its edge.
        self.assertAlmostEqual(mean, metrics["nees.mean:target"], delta=0.01 * mean)
        bounds = sorted(line.get_ydata()[0] for line in axis.lines[:2])
        np.testing.assert_allclose(bounds, [0.0253178, 3.6888795], rtol=1e-6)  # 2 dof

    def test_nees_needs_truth(self):
        folder = self.root / "without_nees"
        shutil.copytree(self.root / "run", folder)
        file = folder / "columns.json"
        columns = json.loads(file.read_text())
        for path, entries in columns.items():
            if not path.endswith("/errors.csv"):
                continue
            known = [c for c in entries if c["quantity"] != "nees"]
            rows = (folder / path).read_text().splitlines()
            text = "".join(",".join(r.split(",")[: len(known)]) + "\n" for r in rows)
            (folder / path).write_text(text)
            columns[path] = known
        file.write_text(json.dumps(columns))
        with self.assertRaisesRegex(alidade.AlidadeError, "no estimator has a NEES"):
            self.figure("without_nees", "nees")

    def test_quantiles_are_those_of_tables(self):
        for share, dof, x in (
            (0.95, 1, 3.841458821),
            (0.025, 3, 0.215795283),
            (0.975, 12, 23.336664),
            (0.999, 100, 149.449253),
        ):
            self.assertAlmostEqual(quantile(share, dof), x, delta=1e-6 * x)

    def test_bytes_are_reproducible_and_fonts_can_be_embedded(self):
        for suffix in plots.FORMATS:
            files = [self.root / f"first{suffix}", self.root / f"second{suffix}"]
            for file in files:
                plots.save(self.figure("run", "errors"), file)
            first, second = (file.read_bytes() for file in files)
            self.assertEqual(first, second, suffix)
            self.assertNotIn(b"CreationDate", first)
        pdf = (self.root / "first.pdf").read_bytes()
        self.assertIn(b"/CIDFontType2", pdf)
        self.assertNotIn(b"/Type3", pdf)
        width = float(re.search(rb"/MediaBox \[ 0 0 (\S+)", pdf).group(1))
        self.assertAlmostEqual(width, 252)  # 3.5 in

    def test_an_unknown_format_is_an_error(self):
        with self.assertRaisesRegex(alidade.AlidadeError, "expected .pdf .svg .png"):
            plots.save(self.figure("run", "errors"), self.root / "figure.jpg")


class ProgramTest(Folders):
    def call(self, *arguments):
        return subprocess.run(
            [sys.executable, "-m", "alidade", *map(str, arguments)],
            cwd=self.root,
            capture_output=True,
            text=True,
        )

    def test_plot_writes_a_figure(self):
        done = self.call("plot", "run", "errors", "--estimators=--help,1e5", "-o", "e.pdf")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue((self.root / "e.pdf").read_bytes().startswith(b"%PDF"))

    def test_table_prints_a_table(self):
        done = self.call("table", "run", "--latex", "--metrics", "rmse:*")
        self.assertEqual(done.returncode, 0)
        self.assertIn(r"\_ekf & 0.", done.stdout)

    def test_an_error_is_one_line(self):
        done = self.call("plot", "nothing", "errors", "-o", "e.pdf")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(done.stderr, "error: nothing: this folder does not exist\n")
        done = self.call("plot", "run", "errors", "-o", "none/e.pdf")
        self.assertEqual(done.returncode, 1)
        self.assertIn("none/e.pdf: cannot write this file: No such file", done.stderr)


if __name__ == "__main__":
    unittest.main()
