# SPDX-License-Identifier: Apache-2.0
"""A trajectory from above, with map, truth and 3 sigma ellipses."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from ..reader import Estimator, Run
from ..table import AlidadeError
from .options import Options
from .state import truth_column
from .style import TRUTH, label_value, legend, line, panels, styles

ELLIPSES = 12  # number of ellipses along a trajectory


def draw(path: Path, options: Options) -> Figure:
    """Draws two axes of the position of each estimator."""
    run = Run(path)
    chosen = options.chosen(run, path)
    blocks = {name: position_block(run[name], options) for name in chosen}
    first = next(iter(chosen))
    names = axis_names(run[first], blocks[first], options)
    figure, (axis,) = panels([""], options.columns)
    axis.set_aspect("equal", adjustable="datalim")
    look = styles(list(chosen))
    parts = set()
    for name in chosen:
        parts |= draw_map(axis, run[name], names, look[name]["color"])
        parts |= draw_trajectory(axis, run[name], blocks[name], names, look[name], options)
    parts |= draw_truth(axis, run, blocks[first], names, options)
    fit_height(figure, axis)
    unit = run[first].estimates.units.get(f"{blocks[first]}.{names[0]}", "")
    axis.set_xlabel(f"{names[0]} [{unit}]")
    label_value(axis, names[1], unit)
    entries = {label: line(**look[name]) for name, label in chosen.items()}
    extra = {
        "truth": line(color=TRUTH, linestyle=":"),
        "start": line(linestyle="", marker="o", markersize=3.5, color="0.3", markerfacecolor="w"),
        "landmark": line(linestyle="", marker="+", markersize=4, color="0.3"),
        "true landmark": line(linestyle="", marker=".", markersize=3, color=TRUTH),
        "3 sigma": line(
            linestyle="", marker="o", markersize=6, color="0.5", fillstyle="none", lw=0.5
        ),
    }
    entries |= {label: handle for label, handle in extra.items() if label in parts}
    legend(figure, entries)
    return figure


def fit_height(figure: Figure, axis: Axes) -> None:
    """Sets the height of a figure so that equal scales leave little space unused."""
    width = figure.get_figwidth()
    ratio = axis.dataLim.height / axis.dataLim.width if axis.dataLim.width > 0 else 1.0
    figure.set_figheight(0.5 + 0.9 * width * min(max(ratio, 0.35), 1.1))


def position_block(estimator: Estimator, options: Options) -> str:
    """Returns the block that is drawn: the block from which landmarks are observed, or the first
    block of length with at least two elements."""
    preferred = estimator.info.get("position_block")
    blocks = [
        block["name"]
        for block in estimator.info["blocks"]
        if block["geometry"] == "vector" and block["size"] >= 2 and block["unit"] == "m"
    ]
    blocks = [preferred] * (preferred is not None) + blocks
    for block in blocks:
        if options.has_block(block, block):
            return block
    raise AlidadeError(f"estimator '{estimator.name}' has no position of two or more elements in m")


def axis_names(estimator: Estimator, block: str, options: Options) -> list[str]:
    """Returns the two drawn axes: those of the options, or the two with the largest range of
    trajectory and map."""
    table = estimator.estimates
    elements = [e.removeprefix(block + ".") for e in table.elements(block)]
    if options.axes:
        if len(options.axes) != 2 or not set(options.axes) <= set(elements):
            raise AlidadeError(
                f"--axes {','.join(options.axes)}: expected two of {', '.join(elements)}"
            )
        return options.axes
    positions = table[block][np.isfinite(table[block]).all(axis=1)]
    if not len(positions):
        raise AlidadeError(f"estimator '{estimator.name}' has no estimates of '{block}'")
    if estimator.has_landmarks:
        points = np.column_stack([estimator.landmarks[name] for name in elements])
        kept = (estimator.landmarks["status"] == "kept") & np.isfinite(points).all(axis=1)
        positions = np.concatenate([positions, points[kept]])
    widest = sorted(np.argsort(-np.ptp(positions, axis=0), kind="stable")[:2])
    return [elements[i] for i in widest]


def draw_trajectory(
    axis: Axes, estimator: Estimator, block: str, names: list[str], look: dict, options: Options
) -> set[str]:
    """Draws a trajectory with ellipses at equal intervals of time."""
    table = estimator.estimates
    rows = np.flatnonzero(options.during(table["t_s"]))
    x, y = (table[f"{block}.{name}"][rows] for name in names)
    axis.plot(x, y, zorder=3, **look)
    axis.plot(x[:1], y[:1], "o", markersize=3.5, markerfacecolor="w", color=look["color"], zorder=4)
    p = position_covariance(estimator, block, names)
    if p is None:
        return {"start"}
    some = np.unique(np.linspace(0, len(rows) - 1, ELLIPSES).astype(int)) if len(rows) else rows
    draw_ellipses(axis, np.column_stack([x, y])[some], p[rows][some], look["color"])
    return {"start", "3 sigma"}


def position_covariance(estimator: Estimator, block: str, names: list[str]) -> np.ndarray | None:
    """Returns the covariances of two elements of the position, or None if the folder does not
    contain P."""
    order = [column.removeprefix("sigma:") for column in estimator.estimates.of("sigma")]
    index = [order.index(f"{block}.{name}") for name in names]
    try:
        return estimator.covariance[:, index][:, :, index]
    except AlidadeError:
        return None


def draw_map(axis: Axes, estimator: Estimator, names: list[str], colour: str) -> set[str]:
    """Draws the landmarks of the final state with their ellipses."""
    if not estimator.has_landmarks:
        return set()
    table = estimator.landmarks
    rows = (table["status"] == "kept") & np.isfinite(table[names[0]]) & np.isfinite(table[names[1]])
    centres = np.column_stack([table[name][rows] for name in names])
    p = np.zeros((len(centres), 2, 2))
    for i, name in enumerate(names):
        p[:, i, i] = table[f"sigma_{name}"][rows] ** 2
    p[:, 0, 1] = p[:, 1, 0] = table[f"cov_{''.join(sorted(names))}"][rows]
    axis.plot(*centres.T, "+", markersize=3, markeredgewidth=0.5, color=colour, zorder=2)
    draw_ellipses(axis, centres, p, colour)
    true = [table[f"true_{name}"][rows] for name in names]
    axis.plot(*true, ".", markersize=2, color=TRUTH, zorder=2)
    return {"landmark", "3 sigma"} | ({"true landmark"} if np.isfinite(true).any() else set())


def draw_truth(axis: Axes, run: Run, block: str, names: list[str], options: Options) -> set[str]:
    """Draws the true trajectory."""
    columns = [truth_column(run, f"{block}.{name}") for name in names]
    if None in columns:
        return set()
    rows = options.during(run.truth["t_s"])
    x, y = (run.truth[column][rows] for column in columns)
    axis.plot(x, y, color=TRUTH, linestyle=":", zorder=3)
    return {"truth"}


def draw_ellipses(axis: Axes, centres: np.ndarray, p: np.ndarray, colour: str) -> None:
    """Draws the 3 sigma ellipse of each covariance. Ellipses do not change the limits."""
    finite = np.isfinite(p).all(axis=(1, 2)) & np.isfinite(centres).all(axis=1)
    if not finite.any():
        return
    variances, directions = np.linalg.eigh(p[finite])
    lengths = 6 * np.sqrt(np.maximum(variances, 0))  # full axes
    angles = np.degrees(np.arctan2(directions[:, 1, 1], directions[:, 0, 1]))
    axis.add_collection(
        EllipseCollection(
            lengths[:, 1],
            lengths[:, 0],
            angles,
            units="xy",
            offsets=centres[finite],
            offset_transform=axis.transData,
            facecolors="none",
            edgecolors=colour,
            linewidths=0.5,
            alpha=0.7,
        ),
        autolim=False,
    )
