# SPDX-License-Identifier: Apache-2.0
"""Distribution of each metric over the runs of a sweep, or its curve over the varied key."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..metrics import DEFAULT, label_of, select, summary_of, value_of
from ..reader import Sweep
from .options import Options
from .style import (
    COLOURS,
    differ_widely,
    label_common_axis,
    label_metric,
    label_rows,
    label_value,
    legend,
    line,
    panels,
    plain,
    styles,
)


def draw(path: Path, options: Options) -> Figure:
    """Draws a panel for each metric."""
    sweep = Sweep(path)
    chosen = options.chosen(sweep.estimators, path)
    parts = [summary_of(part[name]) for part in sweep.values.values() for name in chosen]
    keys = select(options.metrics or DEFAULT, parts)
    keys = [key for key in keys if options.has_block(key.partition(":")[2], "")]
    units = {k: u for part in parts for k, u in part.units.items()}
    draw_panels = draw_curves if sweep.vary else draw_distributions
    return draw_panels(sweep, chosen, {key: label_of(key, units) for key in keys}, options)


def draw_distributions(
    sweep: Sweep, chosen: dict[str, str], keys: dict[str, str], options: Options
) -> Figure:
    """Draws every run as a dot, with median and quartiles, in a row for each estimator."""
    figure, axes = panels([""] * len(keys), options.columns, 0.45 + 0.17 * len(chosen), 2)
    for axis, (key, label) in zip(axes, keys.items()):
        samples = [sample_of(sweep, name, key) for name in chosen]
        for row, sample in enumerate(samples):
            draw_sample(axis, sample, row)
        label_metric(axis, label, np.concatenate(samples))
    label_rows(axes, list(chosen.values()))
    legend(
        figure,
        {
            "a run": line(linestyle="", marker=".", markersize=3, color=COLOURS[0]),
            "median and quartiles": line(marker="|", markersize=6, color="black", lw=1.2),
        },
    )
    return figure


def sample_of(sweep: Sweep, name: str, key: str) -> np.ndarray:
    """Returns the finite values of a metric of all runs in which the estimator did not diverge."""
    runs = sweep.runs
    used = (runs["estimator"] == name) & ~np.isin(runs["verdict"], ["diverged", "failed"])
    values = runs[key][used] if key in runs else np.array([])
    return values[np.isfinite(values)]


def draw_sample(axis: Axes, sample: np.ndarray, row: int) -> None:
    """Draws the values of one row. Their order determines the vertical offset of the dots."""
    if not sample.size:
        return
    offsets = 0.28 * (2 * ((np.arange(sample.size) * 0.618034) % 1) - 1)
    axis.plot(sample, row + offsets, ".", markersize=1.8, alpha=0.6, color=COLOURS[0], mew=0)
    quartiles = np.quantile(sample, [0.25, 0.5, 0.75])
    axis.plot(quartiles[[0, 2]], [row, row], color="black", lw=1.2)
    axis.plot(quartiles[1], row, "|", markersize=7, color="black", mew=1.2)


def draw_curves(
    sweep: Sweep, chosen: dict[str, str], keys: dict[str, str], options: Options
) -> Figure:
    """Draws the mean over the runs with its 95 % interval, over the values of the varied key."""
    x, is_number = positions(list(sweep.values))
    figure, axes = panels(list(keys.values()), options.columns)
    look = styles(list(chosen))
    for axis, key in zip(axes, keys):
        values = []
        for name in chosen:
            entries = [part[name]["metrics"].get(key) for part in sweep.values.values()]
            metrics = [value_of(entry) for entry in entries]
            mean, low, high = (
                np.array([np.nan if v is None else v for v in column], dtype=float)
                for column in zip(*[(m.value, m.low, m.high) for m in metrics])
            )
            axis.plot(x, mean, marker="o", markersize=2.5, **look[name])
            axis.vlines(x, low, high, color=look[name]["color"], lw=0.9)
            values += list(mean)
        label_value(axis, "mean", keys[key].partition("[")[2].rstrip("]"))
        axis.set_yscale("log" if differ_widely(np.array(values)) else "linear")
    label_common_axis(axes, sweep.vary or "")
    if is_number:
        axes[0].set_xscale("log" if differ_widely(x) else "linear")
    else:
        axes[0].set_xticks(x, [plain(value) for value in sweep.values])
    entries = {
        label: line(marker="o", markersize=2.5, **look[name]) for name, label in chosen.items()
    }
    entries["95 % interval of the mean"] = line(linestyle="", marker="|", color="0.3", markersize=6)
    legend(figure, entries)
    return figure


def positions(values: list[str]) -> tuple[np.ndarray, bool]:
    """Returns the positions of the values on the axis: their numbers, or 0, 1, ... for texts."""
    try:
        numbers = np.array([float(value) for value in values])
    except ValueError:
        return np.arange(len(values), dtype=float), False
    return (numbers, True) if np.isfinite(numbers).all() else (np.arange(len(values) * 1.0), False)
