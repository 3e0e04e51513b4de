"""Virtual point clouds: one file that names several point clouds, for programs that show them as one.

It is a STAC ItemCollection with the extensions *pointcloud* and *projection*. Source: specification of PDAL wrench
(https://github.com/PDAL/wrench/blob/main/vpc-spec.md), which QGIS reads from 3.32 on; STAC 1.0.0.
"""

from __future__ import annotations

import datetime as dt
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.export.pointcloud.dimensions import Dimension

_EXTENSIONS = [
    "https://stac-extensions.github.io/pointcloud/v1.0.0/schema.json",
    "https://stac-extensions.github.io/projection/v1.1.0/schema.json",
]
_SIDE = 9  # points of an edge of the box that are carried over into degrees: it bulges there


@dataclass(frozen=True)
class Cloud:
    """A point cloud that is to be named.

    Attributes
    ----------
    name : str
        Size of its file.
    low, high : (3,) float arrays
        Corners of its box, m.
    points : int
    dimensions : sequence of Dimension
    crs : CRS or None
        Its coordinate system; None has no place on Earth.
    """

    name: str
    low: Float
    high: Float
    points: int
    dimensions: Sequence[Dimension]
    crs: CRS | None


def write_vpc(path: Path, cloud: Cloud, date: dt.date, folder: Path) -> None:
    """Write a virtual point cloud that names a point cloud, with paths relative to its folder.

    Other point clouds of the folder that one of that name has listed stay in it, if they are still there.

    Parameters
    ----------
    path : Path
        File to write.
    cloud : Cloud
        In that folder.
    date : date
        Date of the scan.
    folder : Path
        Target folder.
    """
    listed = {name: item for name, item in listed_clouds(folder / path.name).items() if (folder / name).is_file()}
    listed[cloud.name] = _item(cloud, date)
    items = [item for _, item in sorted(listed.items())]
    path.write_text(
        json.dumps({"type": "FeatureCollection", "features": items}, indent=1, ensure_ascii=False, allow_nan=False), "utf-8"
    )


def listed_clouds(path: Path) -> dict[str, dict[str, Any]]:
    """Return the items of a virtual point cloud by the names of their files; none without a file.

    Raises
    ------
    UserError
        If something else is there.
    """
    if not path.is_file():
        return {}
    try:
        items = json.loads(path.read_text("utf-8"))["features"]
        return {Path(item["assets"]["data"]["href"]).name: item for item in items}
    except (ValueError, KeyError, TypeError):
        raise UserError(f"{path} is not a virtual point cloud: move it away, or choose another folder with -o") from None


def _item(cloud: Cloud, date: dt.date) -> dict[str, Any]:
    box = [*cloud.low.tolist(), *cloud.high.tolist()]
    degrees = None if cloud.crs is None else _in_degrees(cloud, cloud.crs)
    item: dict[str, Any] = {
        "type": "Feature",
        "stac_version": "1.0.0",
        "stac_extensions": _EXTENSIONS,
        "id": cloud.name.removesuffix(".copc.laz"),
        "geometry": None if degrees is None else _rectangle(degrees),
        "properties": {
            "datetime": f"{date.isoformat()}T00:00:00Z",
            "pc:count": cloud.points,
            "pc:type": "lidar",
            "pc:encoding": "COPC",
            "pc:schemas": [{"name": d.name, "type": d.type, "size": d.size} for d in cloud.dimensions],
            "pc:statistics": [
                {
                    "name": d.name,
                    "position": position,
                    "average": d.average,
                    "count": d.count,
                    "maximum": d.greatest,
                    "minimum": d.least,
                    "stddev": math.sqrt(d.variance),
                    "variance": d.variance,
                }
                for position, d in enumerate(cloud.dimensions)
                if d.count and d.is_finite
            ],
            "proj:wkt2": "" if cloud.crs is None else cloud.crs.to_wkt("WKT2_2019"),
            "proj:geometry": _rectangle(box),
            "proj:bbox": box,
        },
        "links": [],
        "assets": {
            "data": {
                "href": f"./{cloud.name}",
                "type": "application/vnd.laszip+copc",
                "roles": ["data"],
            }
        },
    }
    if degrees is not None:  # STAC forbids a box where there is no geometry
        item["bbox"] = degrees
    return item


def _in_degrees(cloud: Cloud, crs: CRS) -> list[float] | None:
    """Return the box in WGS 84: west, south, lowest, east, north, highest; heights unchanged."""
    ways = [np.linspace(low, high, _SIDE) for low, high in zip(cloud.low[:2], cloud.high[:2], strict=True)]
    x, y = (values.ravel() for values in np.meshgrid(*ways))
    try:
        east, north = Transformer.from_crs(crs.to_2d(), 4326, always_xy=True).transform(x, y)
    except (CRSError, ProjError):
        return None
    corners = [float(np.min(east)), float(np.min(north)), float(np.max(east)), float(np.max(north))]
    if not np.isfinite(corners).all():
        return None
    return [*corners[:2], float(cloud.low[2]), *corners[2:], float(cloud.high[2])]


def _rectangle(box: Sequence[float]) -> dict[str, Any]:
    """Return the polygon around a box, counterclockwise."""
    west, south, _, east, north, _ = box
    ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
    return {"type": "Polygon", "coordinates": [ring]}
