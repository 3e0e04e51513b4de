"""The public face of each room: what its ``__init__.pyi`` names is there, explained, and costs nothing until it is used."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import tunneldb

ROOMS = sorted(path.parent.name for path in Path(tunneldb.__file__).parent.glob("*/__init__.pyi"))


def test_rooms_have_faces() -> None:
    assert {"geometry", "pointcloud", "radiometry", "raster", "anomalies", "classification", "store", "pipeline"} <= set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_what_a_face_names_is_there_and_explained(room: str) -> None:
    face = importlib.import_module(f"tunneldb.{room}")
    assert face.__all__
    for name in face.__all__:
        found = getattr(face, name)
        if inspect.isclass(found) or inspect.isfunction(found):
            assert inspect.getdoc(found), name


def test_faces_import_nothing_until_asked() -> None:
    lines = [f"import tunneldb.{room}" for room in ROOMS]
    code = "; ".join([*lines, "import sys; print('numba' in sys.modules, 'rasterio' in sys.modules, 'psycopg' in sys.modules)"])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "False"]
