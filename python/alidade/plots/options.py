# SPDX-License-Identifier: Apache-2.0
"""The choices that all figures share."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np

from ..table import AlidadeError, unknown


@dataclass
class Options:
    """The content and the width of a figure. An empty list selects everything.

    estimators  names, in the order in which they are drawn
    labels      names in the legend, in the same order
    columns     width of the figure: 1 or 2 columns of a page, 3.5 or 7.16 inches
    blocks      patterns of blocks or elements, such as `cam.position` or `*.depth`
    metrics     patterns of metrics, such as `rmse:*`
    axes        the two axes of a trajectory, for example `x,z`
    start, end  time interval [s]
    """

    estimators: list[str] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    columns: int = 1
    blocks: list[str] = field(default_factory=list)
    metrics: list[str] = field(default_factory=list)
    axes: list[str] = field(default_factory=list)
    start: float = float("-inf")
    end: float = float("inf")

    def chosen(self, known: Iterable[str], place: object) -> dict[str, str]:
        """Returns the names of the drawn estimators with their labels."""
        known = list(known)
        names = self.estimators or known
        for name in names:
            if name not in known:
                raise unknown("estimator", name, known, place)
        if self.labels and len(self.labels) != len(names):
            raise AlidadeError(
                f"--labels has {len(self.labels)} names; expected {len(names)}, "
                f"for {', '.join(names)}"
            )
        return dict(zip(names, self.labels or names))

    def has_block(self, element: str, block: str) -> bool:
        """Returns true if the element of a block is drawn."""
        patterns = self.blocks or ["*"]
        return any(fnmatchcase(name, p) for name in (element, block) for p in patterns)

    def during(self, t_s: np.ndarray) -> np.ndarray:
        """Returns which timestamps are drawn."""
        return (t_s >= self.start) & (t_s <= self.end)
