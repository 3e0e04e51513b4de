"""Ladders as measured before they were put into the water, and sonar positions, from CSV files."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from tunneldb.csvfile import CsvTable, read_csv, read_texts
from tunneldb.errors import InputError
from tunneldb.registration.underwater import Ladder, Near

COLUMNS = ("rung", "height", "stile_gap", "diameter")
MIN_RUNGS = 3
GAPS = (0.1, 0.6)  # between rungs, m
WIDTHS = (0.1, 1.5)  # between stiles, m
DIAMETERS = (0.005, 0.15)  # m
SAME = 0.0005  # m


def read_ladders(path: Path) -> list[Ladder]:
    """Read ladders: a row ``ladder,rung,height,stile_gap,diameter`` for each rung, m.

    Raises
    ------
    InputError
        If a ladder has too few rungs, or figures that no ladder has; names file, line and value.
    """
    table = read_csv(path, COLUMNS)
    if len(table) == 0:
        raise InputError(f"{path} has no ladder; it needs rows ladder,{','.join(COLUMNS)}")
    names = read_texts(path, "ladder")
    return [_ladder(table, name, [k for k, other in enumerate(names) if other == name]) for name in dict.fromkeys(names)]


def _ladder(table: CsvTable, name: str, rows: list[int]) -> Ladder:
    if not name:
        raise table.error(rows[0], "ladder is empty")
    if len(rows) < MIN_RUNGS:
        raise table.error(rows[0], f"ladder {name} has {len(rows)} rungs; {MIN_RUNGS} are the least")
    for before, row in pairwise(rows):
        gap = table["height"][row] - table["height"][before]
        if not GAPS[0] <= gap <= GAPS[1]:
            raise table.error(
                row,
                f"rung {table['rung'][row]:g} of ladder {name} is {gap:g} m above the one before;"
                f" heights are in metres, growing, {GAPS[0]:g} to {GAPS[1]:g} m apart",
            )
    for column, (low, high) in {"stile_gap": WIDTHS, "diameter": DIAMETERS}.items():
        for row in rows:
            value = table[column][row]
            if not low <= value <= high:
                raise table.error(row, f"{column} of ladder {name} is {value:g} m; {low:g} to {high:g} m is what ladders have")
            if abs(value - table[column][rows[0]]) > SAME:
                raise table.error(row, f"{column} of ladder {name} is {value:g} m, and {table[column][rows[0]]:g} m above")
    number = tuple(round(float(table["rung"][row])) for row in rows)
    if len(set(number)) < len(number):
        raise table.error(rows[0], f"ladder {name} has a rung twice")
    gap, diameter = (float(table[column][rows[0]]) for column in ("stile_gap", "diameter"))
    return Ladder(name, number, np.asarray(table["height"][rows]), gap, diameter)


def read_start(path: Path) -> dict[str, Near]:
    """Read approximate sonar positions: a row ``file,x,y,within`` for each scan with a known one, by the file's name.

    A column ``azimuth`` may follow: direction of the file's x axis in plan, degrees clockwise from the north of the tunnel's
    system, known within 60 degrees.

    Raises
    ------
    InputError
        Names file, line and value.
    """
    table = read_csv(path, ("x", "y", "within", "azimuth"), default={"azimuth": np.nan})
    out: dict[str, Near] = {}
    for row, name in enumerate(read_texts(path, "file")):
        within, azimuth = float(table["within"][row]), float(table["azimuth"][row])
        if not within > 0.0:
            raise table.error(row, f"within is {within:g}; it is how far the sonar may have stood from x, y, in metres")
        if not (np.isnan(azimuth) or -360.0 <= azimuth <= 360.0):
            raise table.error(
                row, f"azimuth is {azimuth:g}; it is the direction of the file's x axis, degrees from north, clockwise"
            )
        if name in out:
            raise table.error(row, f"file {name} occurs twice")
        heading = None if np.isnan(azimuth) else float(np.radians(90.0 - azimuth))
        out[name] = Near(np.array([table["x"][row], table["y"][row]]), within, heading)
    return out
