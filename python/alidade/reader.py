# SPDX-License-Identifier: Apache-2.0
"""The folders that alidade writes. Files are read when they are first used."""
from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .table import AlidadeError, Table, read_rows, unknown

# The file that each command writes last. It distinguishes the kinds of folders.
KINDS = {"run": "run.json", "sweep": "sweep.json", "compare": "compare.json"}


class Estimator:
    """One estimator of a run.

    name     its name in the config
    info     its entry in run.json
    """

    def __init__(self, run: Run, name: str, info: dict[str, Any]) -> None:
        self._run = run
        self.name = name
        self.info = info

    def __repr__(self) -> str:
        return f"Estimator({str(self._run.path)!r}, {self.name!r}, {self.verdict!r})"

    @property
    def metrics(self) -> dict[str, Any]:
        """The metrics by name, for example `rmse:target.depth`."""
        return self.info["metrics"]

    @property
    def verdict(self) -> str:
        """The verdict, for example `consistent`. `info["verdict"]` also contains its reason."""
        return self.info["verdict"]["state"]

    @property
    def has_landmarks(self) -> bool:
        """True if the estimator has a map."""
        return self._run.has_table(f"{self.name}/landmarks.csv")

    @cached_property
    def estimates(self) -> Table:
        """Value and `sigma:` of each block element, with a row for each frame."""
        return self._table("estimates.csv")

    @cached_property
    def errors(self) -> Table:
        """Estimate minus truth, and `sigma:`, of each tangent element of a block with truth."""
        return self._table("errors.csv")

    @cached_property
    def innovations(self) -> Table:
        """Measurement, prediction, outcome and NIS, with a row for each measurement."""
        return self._table("innovations.csv")

    @cached_property
    def gains(self) -> Table:
        """The gain of each accepted measurement."""
        return self._table("gains.csv")

    @cached_property
    def reprojection(self) -> Table:
        """The rms of the innovations of each frame, for sensors that observe landmarks."""
        return self._table("reprojection.csv")

    @cached_property
    def landmarks(self) -> Table:
        """The map of the whole run."""
        return self._table("landmarks.csv")

    @cached_property
    def events(self) -> Table:
        """The events of the filter: time, kind and text."""
        return self._table("events.csv")

    @cached_property
    def covariance(self) -> np.ndarray:
        """P of each row of `estimates`, of shape (rows, n, n). Its order is that of the columns
        `sigma:`. The file exists after `alidade compare` and `alidade run --covariances`."""
        n = len(self.estimates.of("sigma"))
        path = self._run.path / self.name / "covariance.bin"
        try:
            flat = np.fromfile(path, dtype="<f8")
        except FileNotFoundError:
            raise AlidadeError(
                f"{path}: this file does not exist; write it with `alidade run --covariances`"
            ) from None
        rows = len(self.estimates["t_s"])
        if flat.size != rows * n * (n + 1) // 2:
            raise AlidadeError(
                f"{path}: the file contains {flat.size} numbers; "
                f"expected {rows} matrices of {n} x {n}"
            )
        p = np.zeros((rows, n, n))
        i, j = np.tril_indices(n)
        p[:, i, j] = p[:, j, i] = flat.reshape(rows, -1)
        return p

    def _table(self, file: str) -> Table:
        return self._run.table(f"{self.name}/{file}")


class Run(Mapping[str, Estimator]):
    """The folder of `alidade run`, or of `alidade compare` without `--runs`. `run[NAME]` is an
    estimator.

    path     the folder
    info     the content of run.json
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.info = read_json(self.path, "run")
        if "estimators" not in self.info:
            raise AlidadeError(
                f"{self.path}: this run has no results; its status is '{self.info.get('status')}'"
            )
        self._estimators = {
            name: Estimator(self, name, info) for name, info in self.info["estimators"].items()
        }

    def __getitem__(self, name: str) -> Estimator:
        if name not in self._estimators:
            raise unknown("estimator", name, self, self.path)
        return self._estimators[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._estimators)

    def __len__(self) -> int:
        return len(self._estimators)

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r}, {self.status!r}, estimators {', '.join(self)})"

    @property
    def status(self) -> str:
        """`ok`, `stopped` or `failed`. `info["reason"]` contains the cause."""
        return self.info["status"]

    @property
    def verdict(self) -> str:
        """The worst verdict of the estimators."""
        return self.info["verdict"]

    @cached_property
    def truth(self) -> Table:
        """Ground truth, if the source provides it."""
        return self.table("truth.csv")

    @cached_property
    def measurements(self) -> Table:
        """All measurements."""
        return self.table("measurements.csv")

    @cached_property
    def expected(self) -> Table:
        """The noise-free measurements at the true state."""
        return self.table("expected.csv")

    @cached_property
    def implied_states(self) -> Table:
        """The values of blocks that single measurements imply."""
        return self.table("implied_states.csv")

    @cached_property
    def timing(self) -> Table:
        """The wall-clock time of each estimator for each frame."""
        return self.table("timing.csv")

    def table(self, file: str) -> Table:
        """Returns a csv file of the folder, for example `ekf/errors.csv`."""
        if file not in self._columns:
            raise unknown("file", file, self._columns, self.path / "columns.json")
        return Table(self.path / file, self._columns[file])

    def has_table(self, file: str) -> bool:
        """Returns true if the folder has this csv file."""
        return file in self._columns

    @cached_property
    def _columns(self) -> dict[str, list[dict[str, str]]]:
        return load(self.path / "columns.json")


class Sweep:
    """The folder of `alidade sweep`, or of `alidade compare --runs`.

    path     the folder
    info     the content of sweep.json
    vary     the varied key, or None
    values   for each value of the varied key its text and the summaries of the estimators. Without
             a varied key there is one summary, and its text is empty
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.info = read_json(self.path, "sweep")
        self.vary: str | None = self.info.get("vary")
        parts = self.info.get("values", [self.info])
        self.values: dict[str, dict[str, Any]] = {
            part.get("value", ""): part["estimators"] for part in parts
        }

    def __repr__(self) -> str:
        return f"Sweep({str(self.path)!r}, {self.info['runs']} runs, {', '.join(self.estimators)})"

    @property
    def estimators(self) -> list[str]:
        """The names of the estimators."""
        return list(next(iter(self.values.values())))

    @cached_property
    def runs(self) -> Table:
        """Verdict, metrics and counts, with a row for each run and estimator."""
        path = self.path / "runs.csv"
        header = read_rows(path)[0]
        text = {"estimator": "estimator", "verdict": "verdict", self.vary: "text"}
        return Table(path, [{"name": name, "quantity": text.get(name, name)} for name in header])


class Comparison:
    """The folder of `alidade compare`.

    path     the folder
    info     the content of compare.json
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.info = read_json(self.path, "compare")

    def __repr__(self) -> str:
        return f"Comparison({str(self.path)!r}, estimators {', '.join(self.estimators)})"

    @property
    def estimators(self) -> dict[str, dict[str, Any]]:
        """The entry of each estimator, with its `values`, `units` and references."""
        return self.info["estimators"]

    @property
    def decomposition(self) -> dict[str, Any]:
        """The steps of the error decomposition. The dictionary is empty if there are none."""
        return self.info.get("decomposition") or {}

    @cached_property
    def over_time(self) -> Table:
        """RMS errors, bounds and average NEES over the runs at each timestamp; only with
        `--runs`."""
        path = self.path / "over_time.csv"
        return Table(path, [{"name": name, "quantity": name} for name in read_rows(path)[0]])


def load(path: Path) -> dict[str, Any]:
    """Returns the content of a JSON file."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise AlidadeError(f"{path}: this file does not exist") from None
    except (OSError, ValueError) as error:
        raise AlidadeError(f"{path}: cannot read this file: {error}") from None


def kinds_of(path: Path) -> list[str]:
    """Returns the kinds of a folder. The folder of `compare` is also a run or a sweep."""
    return [kind for kind, file in KINDS.items() if (path / file).is_file()]


def is_over_seeds(path: Path) -> bool:
    """Returns true if a folder was written by `alidade compare --runs`."""
    return kinds_of(path) == ["sweep", "compare"]


def read_json(path: Path, kind: str) -> dict[str, Any]:
    """Returns the content of the file that defines a folder of `alidade KIND`."""
    if not path.is_dir():
        raise AlidadeError(f"{path}: this folder does not exist")
    kinds = kinds_of(path)
    if kind in kinds:
        return load(path / KINDS[kind])
    if kinds:
        raise AlidadeError(
            f"{path}: this is a folder of `alidade {kinds[-1]}`; "
            f"expected a folder of `alidade {kind}`, with {KINDS[kind]}"
        )
    raise AlidadeError(f"{path}: this is not a folder of alidade; expected a file {KINDS[kind]}")
