"""Folders of SQL files and migrations: inside the wheel, or beside the package in a checkout."""

from __future__ import annotations

from pathlib import Path
from typing import Literal


def resource_dir(name: Literal["sql", "migrations"]) -> Path:
    """Return the folder of the SQL files or of the migrations.

    Raises
    ------
    FileNotFoundError
        If neither exists, which means a broken installation.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / f"_{name}", package.parent / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"tunneldb is installed without its folder {name!r}; reinstall it")
