"""Resources of the system for tests: programs, and a disk in memory for their servers."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import NoReturn

import pytest

from tunneldb.database.machine import memory_bytes

MEMORY_DISK = Path("/dev/shm")
ROOM, MEMORY = 6 * 2**30, 12 * 2**30
"""Free space of the disk, and memory of the machine, with which two workers keep their servers in memory, bytes."""


def memory_disk() -> Path | None:
    """Return the folder of a disk in memory, where a database is copied in half the time; None if it is small."""
    if not MEMORY_DISK.is_dir() or shutil.disk_usage(MEMORY_DISK).free < ROOM or memory_bytes() < MEMORY:
        return None
    return MEMORY_DISK


def missing(what: str) -> NoReturn:
    """Skip a test whose program is not there; under CI, where scripts/system-packages.sh has installed it, let it fail."""
    if os.environ.get("CI") == "true":
        pytest.fail(f"missing: {what}", pytrace=False)
    pytest.skip(f"missing: {what}")
