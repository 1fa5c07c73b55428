# SPDX-License-Identifier: Apache-2.0
"""Errors within +-3 sigma, or the RMS error over several runs with the Cramer-Rao bound."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..reader import Comparison, Run, is_over_seeds
from .options import Options
from .style import TimeAxis, degrees, label_value, legend, line, panels, styles


def draw(path: Path, options: Options) -> Figure:
    """Draws the errors of a run, or the RMS errors over the runs of a comparison over seeds."""
    return (draw_rms if is_over_seeds(path) else draw_run)(path, options)


def draw_run(path: Path, options: Options) -> Figure:
    """Draws the error of each element, with a panel for each."""
    run = Run(path)
    chosen = options.chosen(run, path)
    tables = {name: run[name].errors for name in chosen}
    elements = list(
        dict.fromkeys(
            element
            for table in tables.values()
            for element in table.of("error")
            if options.has_block(element, table.subject(element))
        )
    )
    figure, axes = panels(elements, options.columns)
    look = styles(list(chosen))
    time = TimeAxis(np.concatenate([table["t_s"] for table in tables.values()]), options)
    for axis, element in zip(axes, elements):
        sizes = []
        for name, table in tables.items():
            if element not in table:
                continue
            factor, unit = degrees(table.units.get(element, ""))
            rows = options.during(table["t_s"])
            t, error = time(table["t_s"][rows]), factor * table[element][rows]
            band = 3 * factor * table[f"sigma:{element}"][rows]
            colour = look[name]["color"]
            axis.fill_between(t, -band, band, color=colour, alpha=0.1, lw=0)
            for sign in (-1, 1):
                axis.plot(t, sign * band, color=colour, lw=0.5)
            axis.plot(t, error, **look[name])
            sizes.append(size_of(error, band))
        label_value(axis, "error", unit)
        set_limit(axis, sizes)
    time.label(axes)
    entries = {label: line(**look[name]) for name, label in chosen.items()}
    entries["+-3 sigma"] = Patch(facecolor="0.9", edgecolor="0.4", lw=0.5)
    legend(figure, entries)
    return figure


def size_of(error: np.ndarray, band: np.ndarray) -> float:
    """Returns the largest value of a curve that the panel should contain: the largest error or
    band, but at most six times the upper quartile of the errors or twice that of the band."""
    error, band = np.abs(error[np.isfinite(error)]), band[np.isfinite(band)]
    if not error.size or not band.size:
        return 0.0
    usual = max(6 * np.quantile(error, 0.75), 2 * np.quantile(band, 0.75))
    return float(min(max(error.max(), band.max()), usual))


def set_limit(axis, sizes: list[float]) -> None:
    """Sets symmetric limits. A curve more than four times as large as another may lie outside."""
    sizes = [size for size in sizes if size > 0]
    if sizes:
        limit = 1.05 * min(max(sizes), 4 * min(sizes))
        axis.set_ylim(-limit, limit)


def draw_rms(path: Path, options: Options) -> Figure:
    """Draws the RMS error over the runs of each block, with the Cramer-Rao bound."""
    comparison = Comparison(path)
    chosen = options.chosen(comparison.estimators, path)
    table = comparison.over_time
    blocks: dict[str, str] = {}
    for name in chosen:
        for block, unit in comparison.estimators[name]["units"].items():
            if f"{name}.rms:{block}" in table and options.has_block(block, block):
                blocks.setdefault(block, unit)
    figure, axes = panels(list(blocks), options.columns)
    look = styles(list(chosen))
    rows = options.during(table["t_s"])
    time = TimeAxis(table["t_s"], options)
    t, has_bound = time(table["t_s"][rows]), False
    for axis, (block, unit) in zip(axes, blocks.items()):
        factor, unit = degrees(unit)
        label_value(axis, "RMS error", unit)
        for name in chosen:
            if f"{name}.rms:{block}" in table:
                axis.plot(t, factor * table[f"{name}.rms:{block}"][rows], **look[name])
        for name in chosen:
            if f"{name}.bound:{block}" in table:
                has_bound = True
                bound = factor * table[f"{name}.bound:{block}"][rows]
                axis.plot(t, bound, color="black", linestyle=":", lw=0.8)
        axis.set_yscale("log")
    time.label(axes)
    entries = {label: line(**look[name]) for name, label in chosen.items()}
    if has_bound:
        entries["Cramer-Rao bound"] = line(color="black", linestyle=":", lw=0.8)
    legend(figure, entries)
    return figure
