"""Trajectory of a scanner in a CSV file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tunneldb.alignment.given import XYZ
from tunneldb.csvfile import CsvTable, read_csv
from tunneldb.errors import InputError
from tunneldb.pointcloud.clock_offsets import WEEK
from tunneldb.pointcloud.week_end import continue_week


def read_trajectory(path: Path) -> tuple[CsvTable, str]:
    """Read times, s, and positions, and continue the times over the end of the GPS week.

    Returns
    -------
    CsvTable
        Columns time, x, y, z: in ascending time if the week ends during the trajectory, else as in the file.
    str
        Remark if the week ends during it; else empty.

    Raises
    ------
    InputError
        If the file cannot be read, or has fewer than 2 rows.
    """
    table = read_csv(path, ("time", *XYZ))
    if len(table) < 2:
        raise InputError(f"{path}: a trajectory needs at least 2 rows, this one has {len(table)}")
    time = continue_week(table["time"], table.columns(XYZ))
    later = int(np.count_nonzero(time != table["time"]))
    if not later:
        return table, ""
    order = np.argsort(time, kind="stable")
    values = np.column_stack([time, table.columns(XYZ)])[order]
    kept = np.append(True, np.diff(values[:, 0]) > 0.0)  # the end of the week may be written as 604800 and as 0
    remark = f"the GPS week ends during the trajectory: {WEEK:.0f} s added to the times of its {later} later poses"
    return replace(table, values=values[kept], lines=table.lines[order][kept]), remark
