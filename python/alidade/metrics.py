# SPDX-License-Identifier: Apache-2.0
"""The metrics of run.json, sweep.json and compare.json in one form: value, interval and unit."""
from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

from .reader import Comparison, Run, Sweep, kinds_of
from .table import AlidadeError

# Units of metrics. `block` is the unit of the block or sensor after the colon.
UNITS = {
    "rmse": "block",
    "implied.rmse": "block",
    "rmsd": "block",
    "final_error": "block",
    "final_difference": "block",
    "trajectory.sim3.rmse": "m",
    "trajectory.sim3.rmsd": "m",
    "map.rmse": "m",
    "map.sim3.rmse": "m",
    "map.rmsd": "m",
    "map.sim3.rmsd": "m",
    "lag_ms": "ms",
    "cpu_us": "us",
    "cpu_us.start": "us",
    "time_us": "us",
    "settling_frames": "frames",
}
DEFAULT = ["rmse:*", "nees.mean:*", "nis.mean:*"]

# The meaning of the numbers in brackets after a value.
MEAN = "mean [95 % interval of the mean]"
SPREAD = "mean (5 % and 95 % quantiles over the runs)"
RATIO = "ratio of the means [95 % interval]"


class Value(NamedTuple):
    """A metric. `low` and `high` have the meaning `meaning`; both are None for a single run."""

    value: float | None
    low: float | None = None
    high: float | None = None
    meaning: str = ""


class Summary(NamedTuple):
    """The metrics of one estimator, with the units of blocks and sensors."""

    metrics: dict[str, Value]
    units: dict[str, str]
    verdict: str


def value_of(entry: Any) -> Value:
    """Returns the metric of an entry of one of the three JSON files."""
    if not isinstance(entry, dict):
        return Value(entry)
    if "mean_low" in entry:
        return Value(entry["mean"], entry["mean_low"], entry["mean_high"], MEAN)
    if "mean" in entry:
        return Value(entry["mean"], entry["p05"], entry["p95"], SPREAD)
    return Value(entry["value"], entry.get("low"), entry.get("high"), RATIO)


def verdicts_of(counts: dict[str, int]) -> str:
    """Returns the verdicts of a sweep with the number of runs of each, `consistent 60`."""
    return ", ".join(f"{verdict} {count}" for verdict, count in counts.items() if count)


def summary_of(entry: dict[str, Any]) -> Summary:
    """Returns the summary of an estimator's entry in one of the three JSON files."""
    metrics = entry.get("values") or entry["metrics"]
    verdict = entry.get("verdict", {}).get("state") or verdicts_of(entry.get("verdicts", {}))
    return Summary(
        {key: value_of(item) for key, item in metrics.items()}, entry.get("units", {}), verdict
    )


def summaries(path: Path) -> dict[str, Summary]:
    """Returns the summary of each estimator of a folder."""
    kinds = kinds_of(path)
    if "compare" in kinds:
        entries = Comparison(path).estimators
    elif "sweep" in kinds:
        sweep = Sweep(path)
        if sweep.vary:
            return {
                f"{name}, {sweep.vary} = {value}": summary_of(entry)
                for value, estimators in sweep.values.items()
                for name, entry in estimators.items()
            }
        entries = sweep.values[""]
    else:
        entries = Run(path).info["estimators"]
    return {name: summary_of(entry) for name, entry in entries.items()}


def select(patterns: list[str], summaries: list[Summary]) -> list[str]:
    """Returns the metrics that match a pattern, such as `rmse:*`, in the order of the patterns. A
    metric of a segment matches only a pattern with a segment, such as `rmse:*@blind`."""
    known = list(dict.fromkeys(key for summary in summaries for key in summary.metrics))
    chosen = patterns or DEFAULT
    found = [
        key
        for pattern in chosen
        for key in sorted(known)
        if fnmatchcase(key, pattern) and ("@" in key) == ("@" in pattern)
    ]
    if not found:
        raise AlidadeError(
            f"no metric matches {', '.join(chosen)}; there are {', '.join(sorted(known))}"
        )
    return list(dict.fromkeys(found))


def unit_of(key: str, units: dict[str, str]) -> str:
    """Returns the unit of a metric, or an empty text."""
    quantity, _, subject = key.partition("@")[0].partition(":")
    unit = UNITS.get(quantity, "")
    return units.get(subject, "") if unit == "block" else unit


def label_of(key: str, units: dict[str, str]) -> str:
    """Returns the name of a metric for a person, with its unit: `rmse target.depth [m]`."""
    unit = unit_of(key, units)
    return key.replace(":", " ") + (f" [{unit}]" if unit else "")
