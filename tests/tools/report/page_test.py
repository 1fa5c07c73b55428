#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tests/tools/report/page_test.py PROGRAM EXAMPLES [TEST...]

Opens pages of `alidade report` in headless Chromium and uses them. PROGRAM is the program alidade,
EXAMPLES the folder of the examples. Exits with 77, which means skipped, if Chromium, its driver or
the Python package selenium is missing.
"""
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
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
source: {type: csv, path: data.csv, streams: {disparity: disparity_px}}
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


class PageTest(unittest.TestCase):
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

    def open_depth(self):
        return self.open("depth", "run", "05_depth_principled/compare.yaml")

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

    def test_comparison(self):
        folder = self.open("comparison", "compare", "05_depth_principled/config.yaml")
        self.expect_sound()
        self.assertTrue(self.browser.find_elements(By.ID, "comparison"))
        self.expect_conclusions(folder / "compare.json")

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
        aligned = self.alidade("eval", truth, estimate, "-as", "-o", page)
        self.assertIn(f"report   {page}", aligned.stdout)
        self.open_page(page)
        self.expect_sound()
        self.assertIn("alignment sim3",
                      self.script("return document.querySelector('.story').textContent"))

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

    def test_the_page_of_a_failed_run_quotes_the_line(self):
        rows = "0,86\n0.1,87\n0.2,x7\n0.3,88\n"
        (self.root / "data.csv").write_text("t_s,disparity_px\n" + rows)
        (self.root / "broken.yaml").write_text(BROKEN)
        self.open("broken", "run", self.root / "broken.yaml")
        self.assertEqual(self.browser.get_log("browser"), [])
        text = self.script("return document.getElementById('failure').innerText")
        self.assertIn("data.csv, line 4", text)
        self.assertIn("0.2,x7", text)

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
        for example in ("10_slam_scene", "08_slam_odometry"):
            if (EXAMPLES / example / "config.yaml").exists():
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

    def test_narrow_and_dark(self):
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": 390, "height": 900, "deviceScaleFactor": 1, "mobile": False})
        try:
            self.open_depth()
            self.script("alidadeReport.setTheme(true); alidadeReport.plots.forEach(p => p.draw())")
            self.expect_sound()
        finally:
            self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
