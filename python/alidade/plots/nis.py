# SPDX-License-Identifier: Apache-2.0
"""NIS of each measurement with its 95 % bounds. Rejected measurements are marked."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..reader import Run
from .consistency import BOUND, bounds_of, draw_bounds, largest_of
from .options import Options
from .style import TimeAxis, label_value, legend, line, panels, styles

MANY = 3000  # points above which a PDF contains the points of a panel as an image


def draw(path: Path, options: Options) -> Figure:
    """Draws a panel for each sensor and each number of degrees of freedom of its measurements."""
    run = Run(path)
    chosen = options.chosen(run, path)
    tables = {name: run[name].innovations for name in chosen}
    time = TimeAxis(np.concatenate([table["t_s"] for table in tables.values()]), options)
    used = {
        name: np.isfinite(table["nis"]) & options.during(table["t_s"])
        for name, table in tables.items()
    }
    keys = sorted(
        {
            (sensor, dof)
            for name, table in tables.items()
            for sensor, dof in zip(table["sensor"][used[name]], table["dof"][used[name]])
            if options.has_block(sensor, sensor)
        }
    )
    figure, axes = panels([f"{sensor}, {dof:g} dof" for sensor, dof in keys], options.columns)
    look = styles(list(chosen))
    has_rejected = False
    for axis, (sensor, dof) in zip(axes, keys):
        label_value(axis, "NIS", "")
        low, high = bounds_of(dof)
        masks = {
            name: used[name] & (table["sensor"] == sensor) & (table["dof"] == dof)
            for name, table in tables.items()
        }
        largest = max(largest_of(tables[name]["nis"][rows]) for name, rows in masks.items())
        bottom = draw_bounds(axis, low, high, largest)
        for name, rows in masks.items():
            table = tables[name]
            rejected = rows & (table["outcome"] != "accepted")
            has_rejected |= bool(rejected.any())
            for mask, marker in ((rows & ~rejected, "."), (rejected, "x")):
                axis.plot(
                    time(table["t_s"][mask]),
                    np.maximum(table["nis"][mask], bottom),
                    linestyle="",
                    marker=marker,
                    markersize=2 if marker == "." else 4,
                    markeredgewidth=0.2 if marker == "." else 0.9,
                    color=look[name]["color"],
                    rasterized=bool(mask.sum() > MANY),
                )
    time.label(axes)
    entries = {
        label: line(linestyle="", marker=".", color=look[name]["color"])
        for name, label in chosen.items()
    }
    if has_rejected:
        entries["not accepted"] = line(linestyle="", marker="x", markersize=4, color="0.4")
    entries["95 % bounds"] = line(**BOUND)
    legend(figure, entries)
    return figure
