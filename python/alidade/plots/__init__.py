# SPDX-License-Identifier: Apache-2.0
"""Figures for papers. Each module draws one figure with `draw(path, options)`."""
from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from ..table import AlidadeError, unknown
from .options import Options

PLOTS = {
    "state": "value, 3 sigma band and truth of each element",
    "errors": "errors within +-3 sigma; over seeds, the RMS error with the Cramer-Rao bound",
    "nees": "NEES of each timestamp with its 95 % bounds; over seeds, the average NEES",
    "nis": "NIS of each measurement with its 95 % bounds; rejected measurements are marked",
    "trajectory": "trajectory with map, truth and 3 sigma ellipses",
    "comparison": "metrics of all estimators, with intervals if there are several runs",
    "sweep": "distribution of each metric over the runs; with --vary, curves over the values",
}
FORMATS = (".pdf", ".svg", ".png")


def figure(path: str | Path, plot: str, options: Options | None = None) -> Any:
    """Returns the matplotlib figure PLOT of a folder."""
    if plot not in PLOTS:
        raise unknown("plot", plot, PLOTS, path)
    try:
        from .style import paper
    except ImportError:
        raise AlidadeError(
            "plots need the package matplotlib, which is not installed; install it with "
            "`apt install python3-matplotlib` or `pip install matplotlib`"
        ) from None
    with paper():
        return import_module(f".{plot}", __name__).draw(Path(path), options or Options())


def save(figure: Any, path: str | Path) -> None:
    """Writes a figure as PDF, SVG or PNG. The same figure always has the same bytes."""
    path = Path(path)
    if path.suffix not in FORMATS:
        raise AlidadeError(f"{path}: '{path.suffix}' is not a format; expected {' '.join(FORMATS)}")
    from .style import paper

    date = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(path.suffix)
    with paper():
        try:
            figure.savefig(path, metadata=date)
        except OSError as error:
            raise AlidadeError(f"{path}: cannot write this file: {error.strerror}") from None
