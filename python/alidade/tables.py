# SPDX-License-Identifier: Apache-2.0
"""Tables for papers. The values are those of run.json, sweep.json or compare.json."""
from __future__ import annotations

import math
from pathlib import Path

from .metrics import Summary, Value, label_of, select, summaries

MISSING = "-"
LATEX = {c: f"\\{c}" for c in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
}


def number(value: float | None) -> str:
    """Returns a number with four digits. JSON contains null for a number that is not finite."""
    if value is None or not math.isfinite(value):
        return "not finite"
    return f"{value:#.4g}".rstrip(".") if value else "0"


def cell(value: Value | None) -> str:
    """Returns a value with its interval. Round brackets are quantiles over the runs."""
    if value is None:
        return MISSING
    text = number(value.value)
    if value.low is None or value.high is None:
        return text
    interval = f"{number(value.low)}, {number(value.high)}"
    return f"{text} ({interval})" if "quantiles" in value.meaning else f"{text} [{interval}]"


def rows_of(path: Path, patterns: list[str], names: dict[str, str]) -> tuple[list[list[str]], str]:
    """Returns the cells, with the header, and a note that explains the brackets."""
    all_summaries = summaries(path)
    chosen: dict[str, Summary] = {name: all_summaries[name] for name in names}
    keys = select(patterns, list(chosen.values()))
    units = {k: u for summary in chosen.values() for k, u in summary.units.items()}
    verdicts = any(summary.verdict for summary in chosen.values())
    rows = [["estimator", *(label_of(key, units) for key in keys)] + ["verdict"] * verdicts]
    for name, summary in chosen.items():
        values = [summary.metrics.get(key) for key in keys]
        rows.append([names[name], *map(cell, values)] + [summary.verdict] * verdicts)
    meanings = {s.metrics[key].meaning for s in chosen.values() for key in keys if key in s.metrics}
    return rows, "; ".join(sorted(meaning for meaning in meanings if meaning))


def markdown(rows: list[list[str]], note: str) -> str:
    """Returns a Markdown table."""
    escaped = [[text.replace("|", "\\|") for text in row] for row in rows]
    rule = ["---"] + ["---:"] * (len(rows[0]) - 1)
    lines = ["| " + " | ".join(row) + " |" for row in [escaped[0], rule, *escaped[1:]]]
    return "\n".join(lines + (["", note] if note else [])) + "\n"


def latex(rows: list[list[str]], note: str) -> str:
    """Returns a LaTeX table that needs the package booktabs."""
    escaped = [["".join(LATEX.get(c, c) for c in text) for text in row] for row in rows]
    lines = [" & ".join(row) + r" \\" for row in escaped]
    return "\n".join(
        [
            r"% \usepackage{booktabs}",
            *([f"% {note}"] if note else []),
            rf"\begin{{tabular}}{{l{'r' * (len(rows[0]) - 1)}}}",
            r"\toprule",
            lines[0],
            r"\midrule",
            *lines[1:],
            r"\bottomrule",
            r"\end{tabular}",
            "",
        ]
    )
