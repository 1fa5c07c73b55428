# SPDX-License-Identifier: Apache-2.0
"""A csv file as numpy arrays with names and units."""
from __future__ import annotations

import csv
import difflib
import io
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

# Kinds of columns that contain text. All other columns contain numbers.
TEXT_QUANTITIES = frozenset(
    "stream sensor landmark outcome kind text id representation status element estimator "
    "verdict".split()
)


class AlidadeError(Exception):
    """A folder, file or name that cannot be used. The text is a full sentence."""


class UnknownName(AlidadeError, KeyError):
    """A name that does not exist."""

    __str__ = Exception.__str__  # KeyError would add quotes


def unknown(kind: str, name: str, known: Iterable[str], place: object) -> UnknownName:
    """Returns the error for the name `name`, with the nearest of the `known` names."""
    known = list(known)
    near = difflib.get_close_matches(str(name), known, 3) or known[:8]
    names = ", ".join(near) + (", ..." if len(near) < len(known) else "")
    return UnknownName(f"{place}: {kind} '{name}' does not exist; expected {names or 'none'}")


def number(cell: str) -> float:
    """Returns the number in a cell. An empty cell is NaN."""
    return float(cell) if cell else float("nan")


class Table(Mapping[str, np.ndarray]):
    """The columns of a csv file, by name. The file is read when a column is first used.

    `table[NAME]` is a column. If NAME is a block with several elements, such as `cam.position` or
    `sigma:cam.position`, it is an array with a column for each element.

    path     the csv file
    columns  name, quantity, unit and subject of each column, as in columns.json
    units    unit of each column that has one
    """

    def __init__(self, path: Path, columns: list[dict[str, str]]) -> None:
        self.path = Path(path)
        self.columns = columns
        self.units = {c["name"]: c["unit"] for c in columns if c.get("unit")}
        self._by_name = {c["name"]: index for index, c in enumerate(columns)}
        self._arrays: dict[str, np.ndarray] = {}

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self.columns)

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self._by_name:
            return self._column(name)
        elements = self.elements(name)
        if not elements:
            raise unknown("column", name, self, self.path)
        return np.column_stack([self._column(element) for element in elements])

    def elements(self, name: str) -> list[str]:
        """Returns the names of the columns of a block, for example of `sigma:cam.position`."""
        prefix, _, block = name.rpartition(":")
        return [
            c["name"]
            for c in self.columns
            if c.get("subject") == block and c["name"].rpartition(":")[0] == prefix
        ]

    def of(self, quantity: str) -> list[str]:
        """Returns the names of all columns of one kind, for example `error`."""
        return [c["name"] for c in self.columns if c["quantity"] == quantity]

    def subject(self, name: str) -> str:
        """Returns the block or estimator of a column."""
        return self.columns[self._by_name[name]].get("subject", name)

    def frame(self) -> Any:
        """Returns the table as a pandas DataFrame. The units are in its `attrs`."""
        try:
            import pandas
        except ImportError:
            raise AlidadeError(
                "a DataFrame needs the package pandas, which is not installed; "
                "install it with `pip install pandas`"
            ) from None
        frame = pandas.DataFrame({name: self[name] for name in self})
        frame.attrs["units"] = dict(self.units)
        return frame

    def _column(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            index = self._by_name[name]
            cells = self._cells[index]
            if self.columns[index]["quantity"] in TEXT_QUANTITIES:
                self._arrays[name] = np.array(cells, dtype=str)
            else:
                self._arrays[name] = self._numbers(name, cells)
        return self._arrays[name]

    def _numbers(self, name: str, cells: tuple[str, ...]) -> np.ndarray:
        try:
            return np.array([number(cell) for cell in cells], dtype=float)
        except ValueError as error:
            raise AlidadeError(f"{self.path}: column '{name}': {error}") from None

    @cached_property
    def _cells(self) -> list[tuple[str, ...]]:
        """The cells of each column. A last row without a line end is ignored: its writer was
        killed."""
        header, *rows = read_rows(self.path)
        if header != list(self):
            raise AlidadeError(f"{self.path}: the header differs from that in columns.json")
        for line, row in enumerate(rows, 2):
            if len(row) != len(header):
                raise AlidadeError(
                    f"{self.path}: row {line} has {len(row)} cells; expected {len(header)}"
                )
        return list(zip(*rows)) if rows else [()] * len(header)


def read_rows(path: Path) -> list[list[str]]:
    """Returns all complete rows of a csv file, with the header."""
    try:
        text = path.read_bytes().decode("utf-8")
    except FileNotFoundError:
        raise AlidadeError(f"{path}: this file does not exist") from None
    except (OSError, UnicodeDecodeError) as error:
        raise AlidadeError(f"{path}: cannot read this file: {error}") from None
    rows = list(csv.reader(io.StringIO(text, newline="")))
    if not text.endswith("\n"):
        rows = rows[:-1]
    if not rows:
        raise AlidadeError(f"{path}: this file does not have a header line")
    return rows
