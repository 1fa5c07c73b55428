# SPDX-License-Identifier: Apache-2.0
"""Value, 3 sigma band and truth of each element of the state."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..reader import Run
from ..table import Table
from .options import Options
from .style import TRUTH, TimeAxis, degrees, label_value, legend, line, panels, styles


def draw(path: Path, options: Options) -> Figure:
    """Draws the elements of the drawn blocks, with a panel for each."""
    run = Run(path)
    chosen = options.chosen(run, path)
    tables = {name: run[name].estimates for name in chosen}
    elements = list(
        dict.fromkeys(
            element
            for table in tables.values()
            for element in table.of("value")
            if options.has_block(element, table.subject(element))
        )
    )
    figure, axes = panels(elements, options.columns)
    look = styles(list(chosen))
    time = TimeAxis(np.concatenate([table["t_s"] for table in tables.values()]), options)
    entries = {label: line(**look[name]) for name, label in chosen.items()}
    for axis, element in zip(axes, elements):
        owners = {name: table for name, table in tables.items() if element in table}
        bands = [draw_estimate(axis, table, element, time, look[name], options)
                 for name, table in owners.items()]  # fmt: skip
        truth = draw_truth(axis, run, element, time, next(iter(owners.values())), options)
        set_limits(axis, truth, np.concatenate(bands))
        if truth.size:
            entries["truth"] = line(color=TRUTH, linestyle=":")
    time.label(axes)
    entries["3 sigma"] = Patch(color="0.5", alpha=0.3, lw=0)
    legend(figure, entries)
    return figure


def draw_estimate(
    axis: Axes, table: Table, element: str, time: TimeAxis, look: dict, options: Options
) -> np.ndarray:
    """Draws an element with its 3 sigma band. Returns the band, which is empty for the elements of
    a quaternion: they have no sigma of their own."""
    factor, unit = degrees(table.units.get(element, ""))
    label_value(axis, "value", unit)
    rows = options.during(table["t_s"])
    t, x = time(table["t_s"][rows]), factor * table[element][rows]
    axis.plot(t, x, **look)
    if f"sigma:{element}" not in table:
        return np.array([])
    band = 3 * factor * table[f"sigma:{element}"][rows]
    axis.fill_between(t, x - band, x + band, color=look["color"], alpha=0.2, lw=0)
    return band


def truth_column(run: Run, element: str) -> str | None:
    """Returns the truth column of an element: the column of the same name, or the only column with
    which the name ends. Returns None if there is none."""
    if not run.has_table("truth.csv"):
        return None
    if element in run.truth:
        return element
    ends = [name for name in run.truth if name != "t_s" and element.endswith("." + name)]
    return ends[0] if len(ends) == 1 else None


def draw_truth(
    axis: Axes, run: Run, element: str, time: TimeAxis, table: Table, options: Options
) -> np.ndarray:
    """Draws the true values of an element, and returns them. The array is empty without truth."""
    column = truth_column(run, element)
    if column is None:
        return np.array([])
    rows = options.during(run.truth["t_s"])
    factor, _ = degrees(table.units.get(element, ""))
    x = factor * run.truth[column][rows]
    axis.plot(time(run.truth["t_s"][rows]), x, color=TRUTH, linestyle=":", zorder=3)
    return x[np.isfinite(x)]


def set_limits(axis: Axes, truth: np.ndarray, band: np.ndarray) -> None:
    """Limits a panel to twice the range of the truth, or twice the usual band, beyond the truth. So
    a vague prior or a diverged estimate does not hide the other curves."""
    if not truth.size:
        return
    band = band[np.isfinite(band)]
    room = 2 * max(np.ptp(truth), np.quantile(band, 0.75) if band.size else 0.0)
    if room > 0:
        low, high = axis.get_ylim()
        axis.set_ylim(max(low, truth.min() - room), min(high, truth.max() + room))
