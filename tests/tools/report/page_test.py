#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tests/tools/report/page_test.py PROGRAM EXAMPLES [TEST...]

Opens pages of `alidade report` in headless Chromium and uses them. PROGRAM is the program alidade,
EXAMPLES the folder of the examples. Exits with 77, which means skipped, if Chromium, its driver or
the Python package selenium is missing. The tests of large pages run only if the environment
variable ALIDADE_LARGE_PAGES is set, or if TEST names them.
"""
import csv
import json
import math
import os
import random
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
except ImportError:
    print("page_test: skipped: the package python3-selenium is not installed")
    sys.exit(77)
for tool in ("chromium", "chromedriver"):
    if shutil.which(tool) is None:
        print(f"page_test: skipped: {tool} is not installed (packages chromium, chromium-driver)")
        sys.exit(77)

PROGRAM, EXAMPLES = sys.argv[1], Path(sys.argv[2])
HOSTILE = """<script>window.attacked = 1</script> "double" 'single' {{data}} </title><img src=x>"""

BROKEN = """alidade: 1
state:
  target:
    model: constant_velocity
    blocks: {position: depth, velocity: depth_rate}
    noise: {kind: discrete, acceleration: 1.0}
    initial: {depth: {mean: 0.3, sigma: 0.1}, depth_rate: {mean: 0, sigma: 0.5}}
sensors:
  stereo:
    model: stereo_disparity
    stream: disparity
    roles: {depth: target.depth}
    focal_px: 400
    baseline_m: 0.065
    sigma_px: 1.0
source: {type: tables, path: data.csv, streams: {disparity: disparity_px}}
estimators: {ekf: {type: ekf}}
"""
# Colours of the pixels of each canvas with a size, as numbers of distinct colours.
COUNT_COLOURS = """
return [...document.querySelectorAll('canvas.base')].filter(c => c.clientWidth).map(c => {
  const data = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
  const colours = new Set();
  for (let i = 0; i < data.length && colours.size < 3; i += 4)
    if (data[i + 3]) colours.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
  return colours.size;
});"""
# Draws all plots, also those that are not in view.
DRAW_ALL = """
for (const details of document.querySelectorAll('details.more')) details.open = true;
await new Promise(resolve => setTimeout(resolve, 300));
for (const plot of alidadeReport.plots) plot.draw();
"""


# A text that runs a script if the page takes it for HTML, without the characters / : and newline.
ATTACK = "<img src=x onerror='window.attacked = 1'>&amp;"
IS_LARGE = bool(os.environ.get("ALIDADE_LARGE_PAGES")) or len(sys.argv) > 3


def number(text):
    """The number of a cell, such as `1 234`, `2.1e-05 ▲` or a dash."""
    match = re.match(r"[-0-9.e∞]+", text.replace("−", "-").replace("\u202f", ""))
    return math.nan if match is None else float(match[0].replace("∞", "inf"))


def is_rounded(shown, value, digits):
    """True if `shown` is `value`, rounded to at least this number of digits."""
    if value is None or not math.isfinite(value):
        return not math.isfinite(shown)
    if value == 0:
        return shown == 0
    return abs(shown - value) <= 0.501 * 10 ** (math.floor(math.log10(abs(value))) + 1 - digits)


def bal_problem(cameras, points, seen):
    """A BAL problem: cameras on a circle of 12 m that look at points near its centre. The noise is
    0.5 px; one observation in a thousand is false."""
    noise = random.Random(1)
    places = [[noise.uniform(-limit, limit) for limit in (4, 3, 2)] for _ in range(points)]
    observations, poses = [], []
    for camera in range(cameras):
        angle = 2 * math.pi * camera / cameras
        cosine, sine = math.cos(angle), math.sin(angle)
        for point in noise.sample(range(points), seen):
            x, y, z = places[point]
            x, z = cosine * x + sine * z, -sine * x + cosine * z - 12
            u = -500 * x / z + noise.gauss(0, 0.5)
            if noise.random() < 0.001:
                u += noise.uniform(-60, 60)
            observations.append(f"{camera} {point} {u} {-500 * y / z + noise.gauss(0, 0.5)}")
        shift = [noise.gauss(0, 0.02) for _ in range(3)]
        poses += [0, angle, 0, shift[0], shift[1], shift[2] - 12, 505, 0, 0]
    start = [value + noise.gauss(0, 0.03) for place in places for value in place]
    head = f"{cameras} {points} {len(observations)}"
    return "\n".join([head, *observations, *map(str, poses + start)]) + "\n"


class PageCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = Path(cls.folder.name)
        options = Options()
        for argument in ("headless=new", "no-sandbox", "disable-gpu", "force-device-scale-factor=1",
                         "hide-scrollbars", "window-size=1280,900"):
            options.add_argument("--" + argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        cls.browser = webdriver.Chrome(service=Service(shutil.which("chromedriver")),
                                       options=options)
        cls.browser.set_script_timeout(300)
        cls.saved = cls.root / "saved"
        cls.saved.mkdir()
        cls.browser.execute_cdp_cmd("Browser.setDownloadBehavior", {
            "behavior": "allow", "downloadPath": str(cls.saved)})

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()
        cls.folder.cleanup()

    def alidade(self, *arguments):
        return subprocess.run([PROGRAM, *map(str, arguments)], cwd=EXAMPLES, text=True,
                              capture_output=True)

    def open(self, name, *arguments):
        """Runs a command with the output folder `name`, and opens the page of this folder."""
        folder = self.root / name
        if not folder.exists():
            self.last = self.alidade(*arguments, "-o", folder)
        self.open_page(folder / "report.html")
        return folder

    def open_page(self, page):
        for kind in ("browser", "performance"):
            self.browser.get_log(kind)  # drops the messages of the previous page
        self.browser.get(page.as_uri())
        self.browser.execute_script(DRAW_ALL)

    def script(self, text, *arguments):
        return self.browser.execute_script(text, *arguments)

    def expect_sound(self):
        """Expects a page without errors, requests, empty canvases and sideways scrolling."""
        self.expect_no_errors()
        colours = self.script(COUNT_COLOURS)
        self.assertGreaterEqual(len(colours), 3)
        self.assertGreaterEqual(min(colours), 3, colours)

    def expect_no_errors(self):
        """Expects a page without errors, requests and sideways scrolling."""
        self.assertEqual(self.browser.get_log("browser"), [])
        urls = []
        for entry in self.browser.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                urls.append(message["params"]["request"]["url"])
        outside = [url for url in urls if not url.startswith(("file:", "data:"))]
        self.assertEqual(outside, [])
        self.assertEqual(len([url for url in urls if url.startswith("file:")]), 1)
        self.assertLessEqual(self.script("return document.documentElement.scrollWidth"),
                             self.script("return innerWidth"))
        self.assertNotIn("NaN", self.script("return document.body.innerText"))
        self.assertNotIn("[object", self.script("return document.body.innerText"))

    def expect_not_attacked(self):
        """Expects that no text of the page has run, also on paper and in a saved figure."""
        self.script("document.querySelectorAll('details').forEach(d => d.open = true)")
        self.script("dispatchEvent(new Event('beforeprint'))")
        self.script("dispatchEvent(new Event('afterprint'))")
        time.sleep(0.3)
        self.assertIsNone(self.script("return window.attacked || null"))
        images = self.script("return document.querySelectorAll('img, i > b, b > i').length")
        self.assertEqual(images, 0)
        self.assertEqual(self.browser.get_log("browser"), [])

    def table(self, selector):
        """The texts of the cells of a table, row by row."""
        return self.script("""
            return [...document.querySelectorAll(arguments[0] + ' tr')]
              .map(row => [...row.cells].map(cell => cell.textContent));""", selector)

    def open_depth(self):
        return self.open("depth", "run", "05_depth_principled/compare.yaml")


class RunPages(PageCase):

    def test_the_command_repeats_the_run(self):
        self.open("set", "run", "05_depth_principled/config.yaml", "--seed", "3", "--set",
                  "sensors.stereo.sigma_px=2")
        self.assertIn("alidade run config.yaml --set sensors.stereo.sigma_px=2 --seed 3",
                      self.script("return document.querySelector('.cmd').textContent"))

    def test_depth_run(self):
        folder = self.open_depth()
        self.expect_sound()
        run = json.loads((folder / "run.json").read_text())
        data = json.loads(self.script("return document.getElementById('data').textContent"))
        for estimator in data["run"]["estimators"]:
            entry = run["estimators"][estimator["name"]]
            self.assertEqual(estimator["metrics"], entry["metrics"])
            self.assertEqual(estimator["verdict"], entry["verdict"])
            self.assertIn(f"{estimator['name']}",
                          self.script("return document.querySelector('.chips').innerText"))
            for nees in estimator["nees"]:
                self.expect_mean_nees(estimator, nees)
        chip = self.script("return document.querySelector('.chip').innerText")
        self.assertIn(run["estimators"]["ekf"]["verdict"]["state"], chip)
        self.assertLess((folder / "report.html").stat().st_size, 400_000)

    def test_tables_equal_run_json(self):
        folder = self.open_depth()
        estimators = json.loads((folder / "run.json").read_text())["estimators"]
        self.script("document.querySelectorAll('details.more').forEach(d => d.open = true)")
        time.sleep(0.3)
        names, *rows = self.table(".tall table")
        self.assertEqual(names[1:], list(estimators))
        checked = 0
        for key, *cells in rows:
            for name, cell in zip(names[1:], cells):
                entry = estimators[name]
                value = {**entry["metrics"], **entry["counts"]}.get(key)
                if isinstance(value, bool):
                    self.assertEqual(cell, "yes" if value else "no")
                elif key in entry["metrics"] or key in entry["counts"]:
                    self.assertTrue(is_rounded(number(cell), value, 4), (name, key, cell, value))
                    checked += 1
        self.assertGreater(checked, 100)
        heads, *rows = self.table("#summary table")[:6]
        prefixes = {"NEES target1 is ideal": "nees.mean:target", "NIS stereo1 is ideal":
                    "nis.mean:stereo", "depthRMSE [mm]": "rmse:target.depth"}
        for head, key in prefixes.items():
            for row in rows:
                value = estimators[row[0]]["metrics"].get(key)
                cell = number(row[heads.index(head)])
                scale = 1e3 if "[mm]" in head else 1
                if value is None:
                    self.assertTrue(math.isnan(cell))
                else:
                    self.assertTrue(is_rounded(cell, value * scale, 3), (key, row, value))

    def expect_mean_nees(self, estimator, nees):
        mean = self.script("""
            const e = alidadeReport.run.estimators.find(q => q.name === arguments[0]);
            const nees = e.nees.find(q => q.owner === arguments[1]);
            const values = [...alidadeReport.columnOf(nees.v)].filter(Number.isFinite);
            return values.reduce((a, b) => a + b, 0) / values.length;
            """, estimator["name"], nees["owner"])
        expected = estimator["metrics"]["nees.mean:" + nees["owner"]]
        self.assertAlmostEqual(mean, expected, delta=1e-4 * expected)

    def test_slam_run(self):
        folder = self.open("slam", "run", "10_slam_scene/config.yaml")
        self.expect_sound()
        for section in ("map", "state", "consistency", "measurements", "inside"):
            self.assertTrue(self.browser.find_elements(By.ID, section), section)
        self.assertLess((folder / "report.html").stat().st_size, 2_000_000)
        slider = "document.querySelector('.slider input')"
        self.script(f"{slider}.value = 500; {slider}.dispatchEvent(new Event('input'))")
        full = self.script("return alidadeReport.page.full")
        self.assertAlmostEqual(self.script("return alidadeReport.page.time"), sum(full) / 2, 2)
        self.expect_landmarks_in_state(folder)

    def test_removed_landmarks(self):
        folder = self.open("pruned", "run", "10_slam_scene/config.yaml", "--set",
                           "landmarks.prune.max_missed_frames=1", "--set",
                           "source.max_features_per_frame=20")
        self.expect_sound()
        self.assertGreater(self.expect_landmarks_in_state(folder), 0)

    def expect_landmarks_in_state(self, folder):
        """Expects that the figure ends with the landmarks that are in the state at the end. Returns
        the number of removed landmarks."""
        with open(folder / "ekf/landmarks.csv") as file:
            rows = [row for row in csv.DictReader(file) if row["first_s"]]
        present = sum(not row["removed_s"] for row in rows)
        shown = self.script("""
            const plot = [...alidadeReport.plots]
              .find(p => p.spec.label === 'landmarks in the state');
            const y = plot.spec.layers()[0].y;
            return y[y.length - 1];""")
        self.assertEqual(shown, present)
        return len(rows) - present

    @unittest.skipUnless(IS_LARGE, "ALIDADE_LARGE_PAGES is not set")
    def test_run_with_500_landmarks(self):
        folder = self.open("landmarks", "run", "10_slam_scene/config.yaml", "--set",
                           "source.points.count=500", "--set", "source.max_frames=40")
        self.expect_sound()
        self.assertLess((folder / "report.html").stat().st_size, 5_000_000)
        self.expect_landmarks_in_state(folder)

    @unittest.skipUnless(IS_LARGE, "ALIDADE_LARGE_PAGES is not set")
    def test_run_of_50000_frames(self):
        folder = self.open("long", "run", "05_depth_principled/compare.yaml", "--set",
                           "source.duration_s=1666.65")
        self.expect_sound()
        run = json.loads((folder / "run.json").read_text())
        self.assertGreaterEqual(run["frames"], 50_000)
        self.assertEqual(len(run["estimators"]), 5)
        self.assertLess((folder / "report.html").stat().st_size, 14_000_000)
        for name, entry in run["estimators"].items():
            self.expect_rmse(name, "target.depth", entry["metrics"]["rmse:target.depth"])
        zoom = """
            const start = performance.now();
            const {page} = alidadeReport;
            page.x = [page.full[1] * arguments[0], page.full[1] * arguments[1]];
            const visible = [...alidadeReport.plots].filter(p => p.seen);
            visible.forEach(p => p.draw());
            return [visible.length, performance.now() - start];"""
        self.script(zoom, 0, 1)
        for window in ([0, 1], [0.4, 0.6], [0.5, 0.51]):
            plots, milliseconds = self.script(zoom, *window)
            self.assertGreater(plots, 0)
            self.assertLess(milliseconds, 2000, window)

    def expect_rmse(self, estimator, block, expected):
        """Expects the rms of the errors of the page. A long column has a resolution of 1e-3."""
        rmse = self.script("""
            const e = alidadeReport.run.estimators.find(q => q.name === arguments[0]);
            const block = e.blocks.find(q => q.name === arguments[1]);
            const errors = [...alidadeReport.columnOf(block.error[0])].filter(Number.isFinite);
            return Math.sqrt(errors.reduce((sum, error) => sum + error ** 2, 0) / errors.length);
            """, estimator, block)
        self.assertAlmostEqual(rmse, expected, delta=1e-3 * expected)

    def test_stopped_run(self):
        self.open_stopped()
        text = self.script("return document.getElementById('failure').innerText")
        self.assertIn("The run was stopped", text)
        self.assertIn("Repeat: alidade run compare.yaml", " ".join(text.split()))
        state = self.table("#last .panel:nth-of-type(1) table")
        self.assertIn("target.depth", [row[1] for row in state])

    def open_stopped(self):
        """Opens the page of a run that looks as if a signal had stopped it."""
        source = self.open_depth()
        folder = self.root / "stopped"
        shutil.copytree(source, folder)
        run = json.loads((folder / "run.json").read_text())
        run["status"] = "stopped"
        (folder / "run.json").write_text(json.dumps(run))
        self.alidade("report", folder)
        self.open_page(folder / "report.html")


class OtherPages(PageCase):
    def test_comparison(self):
        folder = self.open("comparison", "compare", "05_depth_principled/config.yaml")
        self.expect_sound()
        self.assertTrue(self.browser.find_elements(By.ID, "comparison"))
        self.expect_conclusions(folder / "compare.json")

    def test_comparison_over_seeds(self):
        folder = self.open("seeds", "compare", "05_depth_principled/config.yaml", "--runs", "5")
        self.expect_sound()
        self.expect_conclusions(folder / "compare.json")
        heads, *rows = self.table("#comparison table")
        compared = json.loads((folder / "compare.json").read_text())["estimators"]
        self.assertEqual({row[0] for row in rows} & set(compared), set(compared), heads)

    def test_sweep(self):
        folder = self.open("sweep", "sweep", "05_depth_principled/config.yaml", "--runs", "5")
        self.assertTrue(self.last.stdout.endswith(f"\nreport   {folder}/report.html\n"))
        self.expect_sound()
        self.assertTrue(self.browser.find_elements(By.ID, "runs"))
        self.expect_conclusions(folder / "sweep.json")

    def expect_conclusions(self, file):
        """Expects the sentences of a JSON file, which the terminal prints too, on the page."""
        text = self.script("return document.querySelector('.story').textContent")
        conclusions = json.loads(file.read_text())["conclusions"]
        self.assertGreater(len(conclusions), 0)
        for conclusion in conclusions:
            self.assertIn(conclusion["text"], text)

    def test_varied_sweep(self):
        self.open("varied", "sweep", "10_slam_scene/config.yaml", "--runs", "2", "--set",
                  "source.max_frames=30", "--vary", "sensors.pixels.sigma_px=1,2")
        self.expect_sound()
        titles = self.script("return [...document.querySelectorAll('h3')].map(h => h.textContent)")
        self.assertIn("map.rmse", titles)
        self.assertIn("Reprojection error, ekf, pixels", titles)
        command = self.script("return document.querySelector('td .cmd').textContent")
        self.assertIn("--set sensors.pixels.sigma_px=1", command)

    def test_trajectories(self):
        folder = self.open("slam", "run", "10_slam_scene/config.yaml")
        page = self.root / "trajectory.html"
        estimate, truth = folder / "ekf/trajectory.tum", folder / "truth.tum"
        written = self.alidade("report", estimate, "--reference", truth, "-o", page)
        self.assertEqual(written.stdout, f"report   {page}\n", written.stderr)
        self.open_page(page)
        self.expect_sound()
        for section in ("errors", "map", "state"):
            self.assertTrue(self.browser.find_elements(By.ID, section), section)
        second = self.root / "shifted.tum"
        lines = [line.split() for line in estimate.read_text().splitlines() if line[0] != "#"]
        second.write_text("".join(f"{t} {float(x) + 0.1} {' '.join(rest)}\n"
                                  for t, x, *rest in lines))
        aligned = self.alidade("eval", truth, estimate, second, "-as", "-o", page)
        self.assertIn(f"report   {page}", aligned.stdout)
        self.open_page(page)
        self.expect_sound()
        self.assertIn("alignment sim3",
                      self.script("return document.querySelector('.story').textContent"))
        names = self.script("return alidadeReport.run.estimators.map(e => e.name)")
        self.assertEqual(len(names), 2)
        titles = self.script("return [...document.querySelectorAll('h3')].map(h => h.textContent)")
        self.assertIn("ATE translation: spread", titles)

    def test_bundle_adjustment(self):
        problem = self.root / "problem.txt"
        problem.write_text(bal_problem(12, 60, 40))
        folder = self.open("bundle", "bundle", problem)
        self.expect_sound()
        self.expect_rms_of_cameras(folder)
        self.expect_worst(folder)
        count = """
            const plot = [...alidadeReport.plots].find(p => /image plane/.test(p.spec.name));
            plot.draw();
            return plot.layers.map(layer => layer.est);"""
        self.assertEqual(self.script(count), ["before", "after"])
        self.browser.find_element(By.TAG_NAME, "body").send_keys("1")
        self.assertEqual(self.script(count), ["after"])

    def test_tracks_with_times(self):
        tracks = self.root / "tracks"
        self.alidade("simulate", "10_slam_scene/config.yaml", "-o", tracks)
        self.open("tracks_page", "bundle", tracks / "tracks.csv", "--camera",
                  tracks / "calibration.yaml", "--start", tracks / "truth.tum")
        self.expect_sound()
        self.assertTrue(self.browser.find_elements(By.CSS_SELECTOR, ".slider input"))

    @unittest.skipUnless(IS_LARGE, "ALIDADE_LARGE_PAGES is not set")
    def test_bundle_of_80000_observations(self):
        problem = self.root / "large.txt"
        problem.write_text(bal_problem(100, 2000, 800))
        folder = self.open("large", "bundle", problem)
        self.expect_sound()
        self.assertLess((folder / "report.html").stat().st_size, 5_000_000)
        self.expect_worst(folder)
        residuals = self.script("""
            const {total, after} = alidadeReport.bundle.residuals;
            const [u, v] = after.map(alidadeReport.columnOf);
            return [total, u.length, Math.max(...Array.from(u, (x, i) => Math.hypot(x, v[i])))];""")
        self.assertEqual(residuals[0], 80_000)
        self.assertLess(residuals[1], 60_001)
        largest = self.residuals_of(folder)[0][0]
        self.assertAlmostEqual(residuals[2], largest, delta=1e-3 * largest)
        text = self.script("return document.getElementById('bundle').textContent")
        self.assertIn("80\u202f000 residuals", text)

    def residuals_of(self, folder):
        """The sizes, cameras and points of the residuals of a folder, largest first."""
        with open(folder / "observations.csv") as file:
            rows = [row for row in csv.DictReader(file) if row["after.u"]]
        sizes = [(math.hypot(float(row["after.u"]), float(row["after.v"])), int(row["camera"]),
                  int(row["point"])) for row in rows]
        return sorted(sizes, reverse=True)

    def expect_rms_of_cameras(self, folder):
        squares = {}
        for size, camera, _ in self.residuals_of(folder):
            squares.setdefault(camera, []).append(size ** 2)
        shown = self.script("""
            const {id, after} = alidadeReport.bundle.cameras;
            return [id, after].map(ref => [...alidadeReport.columnOf(ref)]);""")
        self.assertEqual(shown[0], sorted(squares))
        for camera, rms in zip(*shown):
            expected = math.sqrt(sum(squares[camera]) / len(squares[camera]))
            self.assertAlmostEqual(rms, expected, delta=1e-5 * expected)

    def expect_worst(self, folder):
        rows = self.table("#bundle .tall table")[1:]
        worst = self.residuals_of(folder)[:20]
        self.assertEqual(len(rows), 20)
        for (camera, point, size, *_), expected in zip(rows, worst):
            self.assertEqual((int(number(camera)), int(number(point))), expected[1:])
            self.assertTrue(is_rounded(number(size), expected[0], 3), (size, expected))


class Use(PageCase):
    def test_legend_hides_an_estimator(self):
        self.open_depth()
        count = """
            alidadeReport.plots.forEach(plot => plot.draw());
            const plot = [...alidadeReport.plots].find(p => /^error of/.test(p.spec.label));
            return plot.layers.filter(layer => layer.est === 'fused_2017').length;"""
        self.assertGreater(self.script(count), 0)
        key = self.browser.find_elements(By.CSS_SELECTOR, ".legend .key")[1]
        self.script("arguments[0].click()", key)
        self.assertEqual(self.script(count), 0)
        self.script("arguments[0].click()", key)
        self.assertGreater(self.script(count), 0)

    def test_a_drag_zooms_all_plots(self):
        self.open_depth()
        plot = self.browser.find_element(By.CSS_SELECTOR, ".plot.time canvas.over")
        self.script("arguments[0].scrollIntoView({block: 'center'})", plot)
        actions = ActionChains(self.browser).move_to_element_with_offset(plot, -100, 0)
        actions.click_and_hold().move_by_offset(200, 0).release().perform()
        full, x = self.script("return [alidadeReport.page.full, alidadeReport.page.x]")
        self.assertLess(x[1] - x[0], 0.5 * (full[1] - full[0]))
        ranges = self.script("""
            alidadeReport.plots.forEach(plot => plot.draw());
            return [...alidadeReport.plots].filter(p => p.spec.time && p.X)
              .map(p => [p.X.lo, p.X.hi]);""")
        self.assertGreater(len(ranges), 3)
        for lo, hi in ranges:
            self.assertEqual([lo, hi], x)

    def test_keys_hide_estimators(self):
        self.open_depth()
        body = self.browser.find_element(By.TAG_NAME, "body")
        hidden = "return [...alidadeReport.page.hidden]"
        body.send_keys("2")
        self.assertEqual(self.script(hidden), ["fused_2017"])
        body.send_keys("2")
        self.assertEqual(self.script(hidden), [])

    def test_the_focus_is_visible(self):
        self.open_depth()
        body = self.browser.find_element(By.TAG_NAME, "body")
        seen = set()
        for _ in range(12):
            body.send_keys("\ue004")  # tab
            tag, style = self.script("""
                const style = getComputedStyle(document.activeElement);
                return [document.activeElement.tagName, style.outlineStyle];""")
            seen.add(tag)
            self.assertNotEqual(style, "none", tag)
        self.assertTrue({"BUTTON", "A", "CANVAS"} & seen, seen)

    def test_the_colour_scheme_of_the_system(self):
        self.open_depth()
        theme = """return [alidadeReport.page.dark,
                           getComputedStyle(document.body).backgroundColor];"""
        grounds = set()
        for scheme in ("dark", "light"):
            feature = {"name": "prefers-color-scheme", "value": scheme}
            self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
            time.sleep(0.2)
            dark, ground = self.script(theme)
            self.assertEqual(dark, scheme == "dark")
            grounds.add(ground)
        self.assertEqual(len(grounds), 2)

    def test_paper(self):
        self.open_depth()
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        try:
            self.script("dispatchEvent(new Event('beforeprint'))")
            bar, canvases, drawings, plots = self.script("""
                const display = (e) => getComputedStyle(e).display;
                const plots = [...alidadeReport.plots].filter(p => p.el.closest('figure'));
                return [display(document.querySelector('.bar')),
                        plots.map(p => display(p.base)),
                        plots.map(p => p.el.querySelectorAll('.printed svg path').length),
                        plots.length];""")
            self.assertEqual(bar, "none")
            self.assertEqual(set(canvases), {"none"})
            self.assertGreater(plots, 5)
            self.assertGreater(min(drawings), 0)
        finally:
            self.script("dispatchEvent(new Event('afterprint'))")
            self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})

    def save(self, title, item):
        """Saves a figure, and returns the path of the file."""
        before = set(self.saved.iterdir())
        self.script("""
            const figure = [...document.querySelectorAll('figure')]
              .find(f => f.querySelector('h3').textContent === arguments[0]);
            figure.querySelector('.menu').open = true;
            [...figure.querySelectorAll('.menu button')]
              .find(b => b.textContent.startsWith(arguments[1])).click();""", title, item)
        for _ in range(100):
            new = [file for file in set(self.saved.iterdir()) - before
                   if file.suffix == "." + item.lower()]
            if new and new[0].stat().st_size:
                return new[0]
            time.sleep(0.1)
        self.fail(f"{title}: no {item} was saved")

    def test_a_saved_svg_has_the_curves(self):
        self.open_depth()
        root = xml.parse(self.save("target · depth", "SVG")).getroot()
        svg = "{http://www.w3.org/2000/svg}"
        self.assertEqual(root.tag, svg + "svg")
        texts = [text.text for text in root.iter(svg + "text")]
        colours = {path.get("stroke") for path in root.iter(svg + "path")
                   if len(path.get("d")) > 1000}
        for name in ("ekf", "fused_2017", "stereo_only", "scale_only", "scale_lambda_known"):
            self.assertIn(name, texts)
        self.assertGreaterEqual(len(colours), 5)
        self.assertIn("depth [mm]", texts)

    def test_errors_are_drawn_although_few_frames_have_truth(self):
        rows = [f"{k / 25},{86.6 + 0.5 * (-1) ** k}" for k in range(500)]
        (self.root / "data.csv").write_text("\n".join(["t_s,disparity_px", *rows]))
        truths = [f"{k / 5},0.3" for k in range(100)]
        (self.root / "truth.csv").write_text("\n".join(["t_s,depth", *truths]))
        source = "{type: tables, files: [{path: data.csv, streams: {disparity: disparity_px}}, " \
                 "{path: truth.csv, truth: {depth: depth}}]}"
        old = BROKEN[BROKEN.index("source: ") + 8:BROKEN.index("estimators")]
        (self.root / "sparse.yaml").write_text(BROKEN.replace(old, source + "\n"))
        self.open("sparse", "run", self.root / "sparse.yaml")
        root = xml.parse(self.save("NEES over time", "SVG")).getroot()
        paths = [path.get("d") for path in root.iter("{http://www.w3.org/2000/svg}path")]
        self.assertGreater(max(d.split("M")[-1].count("L") for d in paths), 50)

    def test_a_saved_png_is_a_picture(self):
        self.open_depth()
        content = self.save("target · depth", "PNG").read_bytes()
        self.assertEqual(content[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(int.from_bytes(content[16:20], "big"), 1800)

    def test_a_saved_csv_has_the_numbers_of_the_run(self):
        folder = self.open_depth()
        with open(self.save("target · depth", "CSV")) as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(rows[0]),
                         ["panel", "series", "x", "y", "sigma", "x_unit", "y_unit"])
        saved = [row for row in rows if (row["panel"], row["series"]) == ("depth", "ekf")]
        with open(folder / "ekf/estimates.csv") as file:
            estimates = list(csv.DictReader(file))
        self.assertEqual(len(saved), len(estimates))
        for row, estimate in zip(saved, estimates):
            self.assertEqual((row["x_unit"], row["y_unit"]), ("s", "m"))
            for key, name in (("x", "t_s"), ("y", "target.depth"), ("sigma", "sigma:target.depth")):
                expected = float(estimate[name])
                self.assertAlmostEqual(float(row[key]), expected, delta=1e-6 * abs(expected))

    def test_every_figure_has_a_csv(self):
        for name in ("depth", "slam"):
            self.open(name, "run", "05_depth_principled/compare.yaml" if name == "depth"
                      else "10_slam_scene/config.yaml")
            empty = self.script("""
                return [...alidadeReport.plots].filter(p => p.csv && !p.csv().length)
                  .map(p => p.spec.name);""")
            self.assertEqual(empty, [])

    def test_narrow_and_dark(self):
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": 390, "height": 900, "deviceScaleFactor": 1, "mobile": False})
        try:
            self.open_depth()
            self.script("alidadeReport.setTheme(true); alidadeReport.plots.forEach(p => p.draw())")
            self.expect_sound()
        finally:
            self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


class Hostile(PageCase):
    def test_hostile_texts_are_shown(self):
        config = (EXAMPLES / "05_depth_principled/config.yaml").read_text()
        lines = [line for line in config.splitlines() if not line.startswith("title:")]
        file = self.root / "hostile.yaml"
        file.write_text("\n".join(lines) + "\ntitle: " + json.dumps(HOSTILE) + "\n")
        self.open("hostile", "run", file)
        self.expect_sound()
        self.assertIsNone(self.script("return window.attacked || null"))
        self.assertEqual(self.script("return document.querySelector('h1').textContent"), HOSTILE)
        self.assertEqual(self.browser.title, HOSTILE + " - alidade")
        self.expect_not_attacked()

    def test_hostile_names_are_shown(self):
        stream = "<b onmouseover='window.attacked = 1'>stream</b>"
        (self.root / "streams.csv").write_text(f"t_s,{ATTACK}\n0,86\n0.1,87\n0.2,88\n")
        text = BROKEN.replace("data.csv", "streams.csv")
        text = text.replace("disparity_px", json.dumps(ATTACK))
        text = text.replace("stream: disparity", "stream: " + json.dumps(stream))
        text = text.replace("{disparity:", "{" + json.dumps(stream) + ":")
        file = self.root / f"{ATTACK}.yaml"
        file.write_text(text)
        self.open("hostile_names", "run", file, "--set", f"title='{ATTACK[:9]}'")
        self.assertEqual(self.last.returncode, 0, self.last.stderr)
        self.expect_not_attacked()
        command = self.script("return document.querySelector('.cmd').textContent")
        self.assertEqual(shlex.split(command)[2], file.name)
        texts = self.script("return document.querySelector('#config').textContent")
        self.assertIn(ATTACK, texts)

    def test_hostile_names_of_trajectories_are_shown(self):
        lines = "".join(f"{k} {k} {0.1 * k * k} 0 0 0 0 1\n" for k in range(30))
        truth = self.root / "truth.tum"
        truth.write_text(lines)
        names = [ATTACK, "<svg onload=window.attacked=1>"]
        for name in names:
            (self.root / f"{name}.tum").write_text(lines)
        page = self.root / "names.html"
        estimates = [self.root / f"{name}.tum" for name in names]
        written = self.alidade("eval", truth, *estimates, "-o", page)
        self.assertEqual(written.returncode, 0, written.stderr)
        self.open_page(page)
        self.expect_sound()
        shown = self.script("return [...document.querySelectorAll('.key')].map(k => k.textContent)")
        self.assertEqual(shown, names)
        self.expect_not_attacked()

    def test_the_page_of_a_failed_run_quotes_the_line(self):
        rows = "0,86\n0.1,87\n0.2,x7\n0.3,88\n"
        (self.root / "data.csv").write_text("t_s,disparity_px\n" + rows)
        (self.root / "broken.yaml").write_text(BROKEN)
        self.open("broken", "run", self.root / "broken.yaml")
        self.assertEqual(self.browser.get_log("browser"), [])
        text = self.script("return document.getElementById('failure').innerText")
        self.assertIn("data.csv, line 4", text)
        self.assertIn("0.2,x7", text)

    def test_hostile_files_are_shown(self):
        header = f"t_s,disparity_px,{HOSTILE.replace(',', '')}"
        row = "0.2,<img src=x onerror='window.attacked = 1'>,0"
        (self.root / "hostile.csv").write_text(f"{header}\n0,86,0\n0.1,87,0\n{row}\n")
        file = self.root / "hostile_file.yaml"
        file.write_text(BROKEN.replace("data.csv", "hostile.csv"))
        self.open("hostile_file", "run", file)
        self.assertEqual(self.browser.get_log("browser"), [])
        self.assertIsNone(self.script("return window.attacked || null"))
        text = self.script("return document.getElementById('failure').innerText")
        self.assertIn(row, text)


class Live(PageCase):
    def start_live(self, name, config, *arguments):
        """Starts a run with a live page and a pipe as the source. Returns process, pipe, address."""
        pipe = self.root / (name + ".pipe")
        os.mkfifo(pipe)
        process = subprocess.Popen(
            [PROGRAM, "run", config, "--set", f"source.path={pipe}", "--live", "0", "-o",
             self.root / name, *arguments], cwd=self.root, text=True, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE)
        writer = open(pipe, "w", buffering=1)
        writer.write("t_s,disparity_px\n")
        line = process.stderr.readline()
        self.assertRegex(line, r"live page at http://127\.0\.0\.1:[0-9]+/")
        return process, writer, line.split(" at ")[1].strip()

    def wait_for(self, condition, what):
        for _ in range(200):
            if self.script("return Boolean(" + condition + ")"):
                return
            time.sleep(0.05)
        self.fail(what + ": " + self.script("return document.body.innerText")[:500])

    def test_live_run(self):
        (self.root / "live.yaml").write_text(BROKEN)
        process, writer, address = self.start_live("live", self.root / "live.yaml")
        rows = (f"{i / 10:.1f},{86 + math.sin(i) / 2:.3f}\n" for i in range(1, 400))
        for _ in range(10):
            writer.write(next(rows))
            time.sleep(0.02)
        self.browser.get_log("browser")
        self.browser.get(address)
        count = "(alidadeReport.run ? alidadeReport.columnOf(alidadeReport.run.t).length : 0)"
        shown = []
        for target in (15, 40, 80):
            while not shown or shown[-1] < target:
                writer.write(next(rows))
                time.sleep(0.02)
                shown.append(self.script("return " + count))
            # The pixels of the plot change, although the plot is not built again.
            shown_plot = self.script("""
                const plot = [...alidadeReport.plots].find(p => p.spec.label === 'depth');
                window.firstPlot = window.firstPlot || plot;
                plot.draw();
                return plot === window.firstPlot && plot.layers[1].x.length;""")
            self.assertEqual(shown_plot, self.script("return " + count))
        self.assertEqual(shown, sorted(shown))
        self.assertRegex(self.script("return document.querySelector('.live').innerText"),
                         "^Live: the figures show the last 1.?000 rows")
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, ".chip"), [])
        writer.close()
        self.wait_for("document.querySelector('.live').innerText.includes('The run has ended')",
                      "the page does not show the end")
        self.assertIn(str(self.root / "live/report.html"),
                      self.script("return document.querySelector('.live').innerText"))
        self.assertTrue(self.browser.find_elements(By.CSS_SELECTOR, ".chip"))
        out, err = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 0, err)
        self.assertIn("live page ended with 0 dropped updates", err)
        self.browser.execute_script(DRAW_ALL)
        self.assertEqual(self.browser.get_log("browser"), [])

    def test_a_killed_live_run(self):
        (self.root / "live.yaml").write_text(BROKEN)
        process, writer, address = self.start_live("killed", self.root / "live.yaml")
        for i in range(10):
            writer.write(f"{i / 10:.1f},86\n")
        self.browser.get(address)
        process.kill()
        process.communicate()
        writer.close()
        self.wait_for("document.querySelector('.live').innerText.includes('program has ended')",
                      "the page does not show that the program is gone")


class Explanations(PageCase):
    def open_explanation(self, name, config, *arguments):
        page = self.root / (name + ".html")
        written = self.alidade("explain", config, "-o", page, *arguments)
        self.assertEqual(written.stdout, f"report   {page}\n", written.stderr)
        self.open_page(page)
        self.expect_no_errors()

    def test_explanation(self):
        self.open_explanation("explained", "05_depth_principled/compare.yaml")
        texts = self.script(
            "return [...document.querySelectorAll('.drawing text')].map(t => t.textContent)")
        for text in ("disparity", "stereo", "\u03c3 1 px", "target.depth", "template"):
            self.assertTrue(any(text in shown for shown in texts), texts)
        boxes = self.script("""
            return [...document.querySelector('.drawing').querySelectorAll('.box')].map(box => {
              const {x, y, width, height} = box.getBBox();
              return [x, y, x + width, y + height];
            });""")
        for i, (left, top, right, bottom) in enumerate(boxes):
            for l, t, r, b in boxes[:i]:
                self.assertFalse(left < r and l < right and top < b and t < bottom)
        self.assertGreater(len(self.browser.find_elements(By.CSS_SELECTOR, ".drawing .link")), 4)
        keys = self.script("return document.getElementById('keys').innerText")
        self.assertIn("sensors.stereo.focal_px", keys)

    def test_explanations_of_other_models(self):
        for example in ("10_slam_scene", "22_range_bearing"):
            self.open_explanation(example, example + "/config.yaml")

    def test_hostile_texts_are_explained(self):
        (self.root / "data.csv").write_text("t_s,disparity_px\n0,86\n")
        config = BROKEN.replace("stream: disparity", "stream: " + json.dumps(HOSTILE))
        config = config.replace("{disparity: disparity_px}",
                                "{" + json.dumps(HOSTILE) + ": disparity_px}")
        file = self.root / "hostile_names.yaml"
        file.write_text(config + "title: " + json.dumps(HOSTILE) + "\n")
        self.open_explanation("hostile_names", file)
        self.assertIsNone(self.script("return window.attacked || null"))
        self.assertEqual(self.script("return document.images.length"), 0)
        self.assertIn(HOSTILE, self.script("return document.querySelector('.drawing').textContent"))

    def test_narrow_explanation(self):
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": 390, "height": 900, "deviceScaleFactor": 1, "mobile": False})
        try:
            self.open_explanation("narrow", "10_slam_scene/config.yaml")
        finally:
            self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
