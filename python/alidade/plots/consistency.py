# SPDX-License-Identifier: Apache-2.0
"""The bounds of NEES and NIS in a panel."""
from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from .chi_square import quantile
from .style import WIDE

BOUND = {"color": "black", "linestyle": (0, (4, 2)), "lw": 0.7, "zorder": 1}


def draw_bounds(axis: Axes, low: float, high: float, largest: float) -> float:
    """Draws bounds, on a logarithmic axis if the values differ widely. Returns the bottom of the
    axis, at which smaller values are drawn."""
    for bound in (low, high):
        axis.axhline(bound, **BOUND)
    if max(high, largest) < WIDE * low:
        axis.set_ylim(0, 1.3 * max(high, largest))
        return 0.0
    axis.set_yscale("log")
    axis.set_ylim(low / 4, 3 * max(high, largest))
    return low / 4


def bounds_of(dof: float) -> tuple[float, float]:
    """Returns the 2.5 % and 97.5 % quantiles of chi-square."""
    return quantile(0.025, dof), quantile(0.975, dof)


def largest_of(values: np.ndarray) -> float:
    """Returns the largest finite value, or 0."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else 0.0
