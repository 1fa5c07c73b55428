# SPDX-License-Identifier: Apache-2.0
"""Figures and tables for papers, from the folders that alidade writes."""
from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path

from . import plots, tables
from .metrics import summaries
from .plots.options import Options
from .table import AlidadeError

EXAMPLES = """examples:
  python3 -m alidade plot runs/depth errors --estimators ekf,ukf --blocks 'target.*' -o errors.pdf
  python3 -m alidade plot runs/slam trajectory --columns 2 -o map.pdf
  python3 -m alidade table runs/sweep-depth --latex --metrics 'rmse:*,nees.mean:*' > table.tex
"""


def names(text: str) -> list[str]:
    """Returns the names of a list with commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    result = argparse.ArgumentParser(
        prog="python3 -m alidade",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = result.add_subparsers(dest="command", required=True, metavar="plot|table")
    plot = commands.add_parser(
        "plot",
        help="draw a figure",
        epilog="plots:\n" + "".join(f"  {n:11} {t}\n" for n, t in plots.PLOTS.items()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    plot.add_argument("-o", "--output", type=Path, metavar="FILE", required=True,
                      help="the figure, .pdf, .svg or .png")  # fmt: skip
    plot.add_argument("--columns", type=int, choices=(1, 2), default=1,
                      help="width in columns of a page: 3.5 or 7.16 in")  # fmt: skip
    plot.add_argument("--blocks", type=names, default=[], metavar="A,B",
                      help="patterns of blocks, elements, state entries or sensors")  # fmt: skip
    plot.add_argument("--axes", type=names, default=[], metavar="X,Y",
                      help="axes of a trajectory; default: those of the largest ranges")  # fmt: skip
    plot.add_argument("--from", type=float, default=float("-inf"), dest="start", metavar="T",
                      help="first timestamp [s]")  # fmt: skip
    plot.add_argument("--to", type=float, default=float("inf"), dest="end", metavar="T",
                      help="last timestamp [s]")  # fmt: skip
    table = commands.add_parser("table", help="print a table of metrics")
    form = table.add_mutually_exclusive_group()
    form.add_argument("--latex", action="store_true", help="LaTeX with booktabs")
    form.add_argument("--markdown", action="store_true", help="Markdown, the default")
    for command in (plot, table):
        command.add_argument("folder", type=Path, metavar="FOLDER",
                             help="folder of run, sweep or compare")  # fmt: skip
        command.add_argument("--metrics", type=names, default=[], metavar="A,B",
                             help="patterns of metrics, such as 'rmse:*'; of the plots, for "
                                  "comparison and sweep")  # fmt: skip
        command.add_argument("--estimators", type=names, default=[], metavar="A,B",
                             help="estimators, in this order")  # fmt: skip
        command.add_argument("--labels", type=names, default=[], metavar="A,B",
                             help="names of the estimators in the result")  # fmt: skip
    plot.add_argument("plot", metavar="PLOT", choices=plots.PLOTS, help="see below")
    return result


def main() -> int:
    """Runs the command. Returns 1 after an error, which is printed."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    arguments = parser().parse_args()
    given = vars(arguments)
    options = Options(**{k: v for k, v in given.items() if k in Options.__dataclass_fields__})
    try:
        if arguments.command == "plot":
            plots.save(plots.figure(arguments.folder, arguments.plot, options), arguments.output)
        else:
            chosen = options.chosen(summaries(arguments.folder), arguments.folder)
            rows, note = tables.rows_of(arguments.folder, options.metrics, chosen)
            sys.stdout.write((tables.latex if arguments.latex else tables.markdown)(rows, note))
    except AlidadeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
