# SPDX-License-Identifier: Apache-2.0
"""Metrics of all estimators, with intervals if there are several runs."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..metrics import RATIO, label_of, select, summaries
from .options import Options
from .style import COLOURS, label_metric, label_rows, legend, line, panels


def draw(path: Path, options: Options) -> Figure:
    """Draws a panel for each metric, with a row for each estimator."""
    entries = summaries(path)
    chosen = options.chosen(entries, path)
    entries = {name: entries[name] for name in chosen}
    keys = [
        key
        for key in select(options.metrics or ["rmse:*"], list(entries.values()))
        if options.has_block(key.partition(":")[2], key.partition(":")[2])
        and any(key in entry.metrics for entry in entries.values())
    ]
    figure, axes = panels([""] * len(keys), options.columns, 0.45 + 0.14 * len(chosen), 2)
    units = {k: u for entry in entries.values() for k, u in entry.units.items()}
    meanings = set()
    for axis, key in zip(axes, keys):
        values = []
        for row, entry in enumerate(entries.values()):
            metric = entry.metrics.get(key)
            if metric is None or metric.value is None:
                continue
            if metric.low is not None and metric.high is not None:
                axis.plot([metric.low, metric.high], [row, row], **look(metric.meaning))
                values += [metric.low, metric.high]
                meanings.add(metric.meaning)
            axis.plot(metric.value, row, marker="o", **look(metric.meaning))
            values.append(metric.value)
        label_metric(axis, label_of(key, units), np.array(values))
    label_rows(axes, list(chosen.values()))
    legend(figure, {meaning: line(marker="o", **look(meaning)) for meaning in sorted(meanings)})
    return figure


def look(meaning: str) -> dict:
    """Returns the look of a value and its interval. A ratio has a colour of its own."""
    return {"color": COLOURS[meaning == RATIO], "lw": 1.2, "markersize": 3.5}
