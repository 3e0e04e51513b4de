"""Scans of real tunnels, which are not part of the project: their folder is in TUNNELDB_REAL_SCANS."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

VARIABLE = "TUNNELDB_REAL_SCANS"


def real_scan(name: str) -> Path:
    """Path of a file in the folder of real scans; without it the test is skipped, and says why."""
    folder = os.environ.get(VARIABLE)
    if not folder:
        pytest.skip(f"real scans: {VARIABLE} names no folder")
    path = Path(folder) / name
    if not path.exists():
        pytest.skip(f"real scans: there is no {path}")
    return path
