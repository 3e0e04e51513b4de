"""A line, and files of it: maps by GDAL, drawings by ezdxf."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import ezdxf
import numpy as np
import pyogrio
import shapely

from tunneldb.alignment.given import GivenAxis
from tunneldb.arrays import Float

SRID = 25830
J_LANDXML = Path(__file__).parents[1] / "data" / "j-landxml.xml"
LINE = np.array(
    [[500_000.0, 4_640_000.0, 100.0], [500_050, 4_640_000, 101], [500_099, 4_640_010, 102], [500_147, 4_640_024, 103]]
)


def gis(
    path: Path, geometries: list[shapely.Geometry], srid: int | None = SRID, layer: str | None = None, **more: object
) -> Path:
    pyogrio.raw.write(
        path,
        np.array([None if g is None else shapely.to_wkb(g) for g in geometries], dtype=object),
        [],
        [],
        layer=layer,
        geometry_type=more.pop("geometry_type", None) or geometries[0].geom_type + (" Z" if geometries[0].has_z else ""),
        crs=f"EPSG:{srid}" if srid else None,
        **more,
    )
    return path


def pieces(xyz: Float = LINE) -> list[shapely.Geometry]:
    """The line in pieces, out of order, the middle one drawn backwards."""
    return [shapely.LineString(xyz[2:]), shapely.LineString(xyz[[2, 1]]), shapely.LineString(xyz[:2])]


def dxf(path: Path, draw: Callable, insunits: int = 6) -> Path:  # type: ignore[type-arg]
    document = ezdxf.new("R2018")
    document.header["$INSUNITS"] = insunits
    draw(document.modelspace())
    document.saveas(path)
    return path


def chain(space: object) -> None:
    for a, b in ((2, 3), (1, 0), (1, 2)):
        space.add_line(LINE[a], LINE[b], dxfattribs={"layer": "AXIS"})  # type: ignore[attr-defined]


def plan_length(given: GivenAxis) -> float:
    return float(np.hypot(*np.diff(given.xyz[:, :2], axis=0).T).sum())


def written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def edited(path: Path, old: str, new: str) -> Path:
    content = path.read_text()
    assert old in content
    path.write_text(content.replace(old, new))
    return path
