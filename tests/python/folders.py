# SPDX-License-Identifier: Apache-2.0
"""The folders that the tests read. The program in the variable ALIDADE writes them."""
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

# The names are valid, but a careless reader takes them for numbers, options or private names, and
# the stream needs quotes in a csv file and escapes in a figure.
CONFIG = """
alidade: 1
state:
  target:
    model: constant_velocity
    blocks: {position: depth, velocity: depth_rate}
    noise: {kind: continuous, acceleration: 0.05}
    initial: {depth: {mean: 5, sigma: 0.2}, depth_rate: {mean: 0, sigma: 0.1}}
sensors:
  "nan":
    {model: stereo_disparity, stream: 'left, "right" $\\sigma$', roles: {depth: target.depth},
     focal_px: 400, baseline_m: 0.2, sigma_px: 0.5}
source:
  {type: models, seed: 1, duration_s: 3, rate_hz: 20,
   sensors: {"nan": {outliers: {share: 0.1, sigma_scale: 30}}}}
estimators:
  _ekf: {type: ekf, gate: 0.999}
  "1e5": {type: ukf, gate: 0.999}
  "--help": {type: rts, gate: 0.999}
"""
POSES = """
alidade: 1
state:
  body:
    model: quaternion_pose
    noise: {kind: continuous, linear_acceleration: 0.5, angular_acceleration: 0.5}
    initial:
      position: {mean: [0, 0, 0], sigma: 0.2}
      orientation: {mean: {w: 1, x: 0, y: 0, z: 0}, sigma: 0.2}
      velocity: {mean: [0, 1, 2], sigma: 0.3}
      angular_velocity: {mean: [0, 0, 0.5], sigma: 0.3}
sensors:
  mocap:
    {model: pose, stream: pose, roles: {position: body.position, orientation: body.orientation},
     sigma_position_m: 0.05, sigma_orientation_rad: 0.02}
source: {type: models, seed: 1, duration_s: 5, rate_hz: 10}
estimators: {ekf: {type: ekf}}
"""
NAMES = ["_ekf", "1e5", "--help"]
STREAM = 'left, "right" $\\sigma$'


def alidade(*arguments: str, folder: Path) -> None:
    """Runs the program."""
    done = subprocess.run(
        [os.environ["ALIDADE"], *arguments], cwd=folder, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"alidade {' '.join(arguments)}: {done.stderr}")


class Folders(unittest.TestCase):
    """A test with the folders `run`, `poses`, `sweep`, `vary`, `compare` and `seeds`."""

    @classmethod
    def setUpClass(cls) -> None:
        cls._temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls._temporary.cleanup)
        cls.root = Path(cls._temporary.name)
        (cls.root / "config.yaml").write_text(CONFIG)
        (cls.root / "poses.yaml").write_text(POSES)
        compare = ("compare", "config.yaml", "--no-decomposition", "--quiet")
        for arguments in (
            ("run", "config.yaml", "--quiet", "--covariances", "-o", "run"),
            ("run", "poses.yaml", "--quiet", "--covariances", "-o", "poses"),
            ("sweep", "config.yaml", "--runs", "5", "--quiet", "-o", "sweep"),
            ("sweep", "config.yaml", "--runs", "3", "--quiet", "-o", "vary",
             "--vary", "source.duration_s=1,2,3"),
            (*compare, "-o", "compare"),
            (*compare, "--runs", "3", "-o", "seeds"),
        ):  # fmt: skip
            alidade(*arguments, folder=cls.root)
