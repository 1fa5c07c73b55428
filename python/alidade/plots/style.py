# SPDX-License-Identifier: Apache-2.0
"""The form of all figures: size, fonts, colours, panels and legend."""
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..table import AlidadeError
from .options import Options

WIDTH_IN = {1: 3.5, 2: 7.16}  # one and two columns of a page of the IEEE
PAGE_IN = 8.6  # largest height of all panels together
LOWEST_IN = 0.7  # lowest height of a legible panel
TRUTH = "black"
WIDE = 20  # a logarithmic axis shows values whose ratio is larger
# The colours of Okabe and Ito, which people with colour blindness can distinguish, without black.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"]
DASHES = ["-", (0, (5, 1.5)), (0, (4, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)), (0, (3, 1, 1, 1, 1, 1))]


def paper() -> Any:
    """Returns a context with the settings of all figures."""
    return matplotlib.rc_context(
        {
            "font.family": "DejaVu Sans",
            "font.size": 7,
            "axes.titlesize": 7,
            "axes.titlelocation": "left",
            "axes.titlepad": 3,
            "axes.labelsize": 7,
            "axes.linewidth": 0.6,
            "axes.grid": True,
            "axes.axisbelow": True,
            "grid.color": "0.9",
            "grid.linewidth": 0.5,
            "xtick.labelsize": 6.5,
            "ytick.labelsize": 6.5,
            "lines.linewidth": 0.9,
            "legend.fontsize": 7,
            "legend.frameon": False,
            "pdf.fonttype": 42,
            "svg.hashsalt": "alidade",
            "savefig.dpi": 300,
        }
    )


def plain(text: str) -> str:
    """Returns a text that matplotlib draws unchanged. A dollar sign would begin a formula."""
    return text.replace("$", r"\$")


def styles(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Returns colour and line style of each name."""
    return {
        name: {
            "color": COLOURS[i % len(COLOURS)],
            "linestyle": DASHES[(i + i // len(COLOURS)) % len(DASHES)],
        }
        for i, name in enumerate(names)
    }


def panels(
    titles: Sequence[str], columns: int, height_in: float = 1.15, side_by_side: int = 3
) -> tuple[Figure, list[Axes]]:
    """Returns a figure with a panel for each title.

    The panels are stacked. More than five panels of a figure of two columns stand in rows of
    `side_by_side`. Many panels are lower, so that they fit on a page.
    """
    if not titles:
        raise AlidadeError("nothing to draw: no element, sensor or metric matches the options")
    wide = side_by_side if columns == 2 and len(titles) > 5 else 1
    rows = math.ceil(len(titles) / wide)
    lowest_in = min(height_in, LOWEST_IN)
    height_in = min(height_in, PAGE_IN / rows)
    if height_in < lowest_in:
        raise AlidadeError(
            f"{len(titles)} panels do not fit on a page; "
            "choose some with --blocks or --metrics, or use --columns 2"
        )
    figure = Figure(figsize=(WIDTH_IN[columns], 0.35 + height_in * rows), layout="constrained")
    FigureCanvasAgg(figure)
    figure.get_layout_engine().set(w_pad=0.03, h_pad=0.03, hspace=0.02, wspace=0.02)
    axes = list(figure.subplots(rows, wide, squeeze=False).flat)
    for unused in axes[len(titles) :]:
        unused.remove()
    axes = axes[: len(titles)]
    for axis, title in zip(axes, titles):
        axis.set_title(plain(title))
    return figure, axes


def label_common_axis(axes: Sequence[Axes], label: str) -> None:
    """Links the horizontal axes of all panels, and labels those without a panel below them."""
    lowest = {axis.get_subplotspec().colspan.start: axis for axis in axes}.values()
    for axis in axes:
        if axis is not axes[0]:
            axis.sharex(axes[0])
        axis.tick_params(labelbottom=axis in lowest)
        if axis in lowest:
            axis.set_xlabel(plain(label))
    axes[0].autoscale_view(scaley=False)
    axes[0].figure.align_ylabels(axes)


def label_rows(axes: Sequence[Axes], names: Sequence[str]) -> None:
    """Labels the rows of panels that have a row for each name."""
    for axis in axes:
        is_first = axis.get_subplotspec().colspan.start == 0
        axis.set_yticks(range(len(names)), [plain(name) if is_first else "" for name in names])
        axis.set_ylim(len(names) - 0.5, -0.5)


def label_metric(axis: Axes, label: str, values: np.ndarray) -> None:
    """Labels the horizontal axis of a metric, and makes it logarithmic if the values differ
    widely."""
    if differ_widely(values):
        axis.set_xscale("log")
    else:
        axis.locator_params(axis="x", nbins=5)
    axis.set_xlabel(plain(label), labelpad=1, loc="left")


def differ_widely(values: np.ndarray) -> bool:
    """Returns true if a logarithmic axis is better. Zeros are not visible on such an axis."""
    finite = np.asarray(values)[np.isfinite(values)]
    positive = finite[finite > 0]
    return bool(positive.size and finite.min() >= 0 and positive.max() > WIDE * positive.min())


class TimeAxis:
    """The common time axis. Large timestamps, such as seconds since 1970, are shown relative to
    the first one."""

    def __init__(self, t_s: np.ndarray, options: Options) -> None:
        if not options.during(t_s).any():
            times = f"; expected times from {t_s.min():g} to {t_s.max():g} s" if len(t_s) else ""
            raise AlidadeError(f"no row is between --from and --to{times}")
        first = float(t_s.min())
        self.origin_s = math.floor(first) if abs(first) >= 1e5 else 0

    def __call__(self, t_s: np.ndarray) -> np.ndarray:
        return t_s - self.origin_s

    def label(self, axes: Sequence[Axes]) -> None:
        """Labels the panels."""
        label_common_axis(axes, f"time - {self.origin_s} s [s]" if self.origin_s else "time [s]")


def degrees(unit: str) -> tuple[float, str]:
    """Returns the factor and the unit in which a figure shows values of a unit."""
    if unit.split("/")[0] == "rad":
        return 180 / math.pi, unit.replace("rad", "deg", 1)
    return 1.0, unit


def label_value(axis: Axes, name: str, unit: str) -> None:
    """Labels the vertical axis."""
    axis.set_ylabel(plain(f"{name} [{unit}]" if unit else name))


def legend(figure: Figure, entries: dict[str, Any]) -> None:
    """Draws a legend above the panels. Its height is measured, and the panels move down."""
    if not entries:
        return
    renderer = figure.canvas.get_renderer()
    width = figure.bbox.width
    for columns in range(len(entries), 0, -1):
        # matplotlib would omit labels that begin with '_', so the labels are set afterwards.
        box = figure.legend(
            list(entries.values()),
            ["x"] * len(entries),
            loc="upper center",
            ncol=columns,
            borderaxespad=0.2,
            columnspacing=1.2,
            handlelength=2.2,
        )
        for text, label in zip(box.get_texts(), entries):
            text.set_text(plain(label))
        extent = box.get_window_extent(renderer)
        if extent.width <= width or columns == 1:
            break
        box.remove()
    free = 1 - (extent.height + 4) / figure.bbox.height
    figure.get_layout_engine().set(rect=(0, 0, 1, free))


def line(**style: Any) -> Line2D:
    """Returns a line for the legend."""
    return Line2D([], [], **style)
