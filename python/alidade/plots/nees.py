# SPDX-License-Identifier: Apache-2.0
"""NEES of each timestamp with its 95 % bounds, or the average NEES over several runs."""
from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ..reader import Comparison, Run, is_over_seeds
from ..table import AlidadeError
from .consistency import BOUND, bounds_of, draw_bounds, largest_of
from .options import Options
from .style import TimeAxis, label_value, legend, line, panels, styles


class Series(NamedTuple):
    """The NEES of one state entry over time, with its 95 % bounds."""

    t_s: np.ndarray
    nees: np.ndarray
    low: float
    high: float


def draw(path: Path, options: Options) -> Figure:
    """Draws a panel for each state entry. For a comparison over seeds, draws the average NEES."""
    over_runs = is_over_seeds(path)
    if over_runs:
        comparison = Comparison(path)
        chosen = options.chosen(comparison.estimators, path)
        series = {name: averages(comparison, name) for name in chosen}
    else:
        run = Run(path)
        chosen = options.chosen(run, path)
        series = {name: values(run, name) for name in chosen}
        if not any(series.values()):
            raise AlidadeError(
                f"{path}: no estimator has a NEES; the NEES needs the truth of a block that has a "
                "covariance"
            )
    owners = [
        owner
        for owner in dict.fromkeys(owner for entries in series.values() for owner in entries)
        if options.has_block(owner, owner)
    ]
    figure, axes = panels(owners, options.columns)
    look = styles(list(chosen))
    times = [s.t_s for entries in series.values() for s in entries.values()]
    time = TimeAxis(np.concatenate(times), options)
    for axis, owner in zip(axes, owners):
        label_value(axis, "ANEES" if over_runs else "NEES / dof", "")
        present = {name: entries[owner] for name, entries in series.items() if owner in entries}
        bounds = next(iter(present.values()))
        largest = max(largest_of(s.nees[options.during(s.t_s)]) for s in present.values())
        bottom = draw_bounds(axis, bounds.low, bounds.high, largest)
        for name, s in present.items():
            rows = options.during(s.t_s)
            axis.plot(time(s.t_s[rows]), np.maximum(s.nees[rows], bottom), **look[name])
    time.label(axes)
    entries = {label: line(**look[name]) for name, label in chosen.items()}
    entries["95 % bounds"] = line(**BOUND)
    legend(figure, entries)
    return figure


def values(run: Run, name: str) -> dict[str, Series]:
    """Returns the NEES / dof of each state entry of an estimator. The bounds are those of the mean
    number of degrees of freedom."""
    table = run[name].errors
    series = {}
    for column in table.of("nees"):
        owner = table.subject(column)
        dof = run[name].metrics.get(f"nees.dof:{owner}")
        if dof:
            low, high = bounds_of(dof)
            series[owner] = Series(table["t_s"], table[column], low / dof, high / dof)
    return series


def averages(comparison: Comparison, name: str) -> dict[str, Series]:
    """Returns the average of NEES / dof over the runs for each state entry of an estimator."""
    return {
        owner: Series(
            np.array(entry["t_s"], dtype=float),
            np.array(entry["mean"], dtype=float),
            float(np.median(np.array(entry["low"], dtype=float))),
            float(np.median(np.array(entry["high"], dtype=float))),
        )
        for owner, entry in comparison.estimators[name].get("anees", {}).items()
    }
