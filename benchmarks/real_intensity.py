"""A real intensity image of a metro lining, put on an arch with upright walls and inspected as a scan.

    python -m benchmarks.real_intensity FOLDER            # FOLDER has intensity.png and wet-by-eye.png; two minutes

The image is the unrolled lining of a shield tunnel (Tongji University, repository cqc2/pc-tunnel, for non-commercial use; it is
no part of this repository), with what an eye takes for wet. It has no relief: its rows of cables are put 8 cm in front of the
lining, and its rows of track and walkway on a floor. The walls are upright, because the lowest wall of a round tunnel is so
flat that it could be floor. Lengths around the tunnel stay. Each pixel becomes POINTS points, as in a dense scan.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import rasterio.features
import shapely
from PIL import Image
from rasterio import Affine
from shapely.geometry import box, shape

from benchmarks.common import progress, save, scratch_database, tunneldb
from benchmarks.network.metro import CABLES, STEP, WALLS, WHITE
from tunneldb.database import connect

RADIUS, POINTS, SIMPLE = 2.75, 4, 0.02
"""Radius of the arch, m; points of a pixel; tolerance of the outlines by eye, m."""

PLACE = np.array([500_000.0, 4_000_000.0, 10.0])
"""Coordinates of the beginning of the axis, m. The axis runs east."""

CABLE_OFFSET = 0.08
"""Distance of cables from the lining, m."""

WALKWAY = 0.9
"""Distance of the edge of the walkway from the middle of the track, m."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.real_intensity", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="keep the survey's image and leaks here")
    arguments = parser.parse_args()
    grey, wet = (np.asarray(Image.open(arguments.folder / name).convert("L")) for name in ("intensity.png", "wet-by-eye.png"))
    with scratch_database(arguments.dsn) as dsn, tempfile.TemporaryDirectory() as folder:
        result = inspect(grey, wet > 127, Path(folder), dsn, arguments.output)
    print(json.dumps(result, indent=2))
    save("real_intensity", result)


def inspect(grey: np.ndarray, wet: np.ndarray, folder: Path, dsn: str, kept: Path | None) -> dict[str, Any]:
    """Load and run the scan; compare leaks and undecided bands with what is wet by eye."""
    pixel = 2.0 * np.pi * RADIUS / len(grey)
    write_scan(grey, pixel, folder / "scan.las")
    truth = outlines(wet, pixel)
    features = [{"type": "Feature", "properties": {}, "geometry": shapely.geometry.mapping(one)} for one in truth]
    (folder / "truth.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    ends = PLACE + np.array([[0.0, 0.0, 0.0], [grey.shape[1] * pixel, 0.0, 0.0]])
    np.savetxt(folder / "axis.csv", ends, "%.4f", delimiter=",", header="x,y,z", comments="")
    tunneldb("tunnel", "add", "metro", "--srid", 25830, "--axis", folder / "axis.csv", dsn=dsn)
    intensity = ("--intensity", "Reflectance", "--intensity-kind", "reflectance", "--no-poses")
    tunneldb("survey", "add", "metro", "--tunnel", "metro", "--date", "2016-01-01", *intensity, dsn=dsn)
    tunneldb("load", "metro", folder / "scan.las", dsn=dsn)
    progress(f"run: {tunneldb('run', 'metro', dsn=dsn):.0f} s")
    tunneldb("evaluate", "metro", folder / "truth.geojson", "-o", folder / "figures.json", dsn=dsn)
    with connect(dsn) as conn:
        places = conn.execute("SELECT chainage_from, arc_from, chainage_to, arc_to FROM tunnel_api.dark_band").fetchall()
    bands = shapely.union_all([box(*place) for place in places])
    true = shapely.union_all(truth)
    if kept is not None:
        kept.mkdir(parents=True, exist_ok=True)
        tunneldb("leaks", "metro", "-o", kept / "leaks.geojson", dsn=dsn)
        tunneldb("image", "metro", "-o", kept, dsn=dsn)
    figures: dict[str, Any] = json.loads((folder / "figures.json").read_text())
    return {"evaluate": figures, "wet": true.area, "bands": bands.area, "wet_in_bands": bands.intersection(true).area}


def write_scan(grey: np.ndarray, pixel: float, path: Path) -> None:
    """Write the image as points of a scan, with the intensity in decibels."""
    rng = np.random.default_rng(1)
    row, column = (np.repeat(index, POINTS) for index in np.nonzero(grey < WHITE))
    along = (column + rng.uniform(size=len(column))) * pixel
    place = row + rng.uniform(size=len(row))
    arc = (len(grey) / 2 - place) * pixel  # positive to the right
    behind = np.zeros(len(row))
    for first, stop in CABLES:
        behind[(row >= first) & (row < stop)] = CABLE_OFFSET
    turn = np.clip(arc / RADIUS, -np.pi / 2, np.pi / 2)  # half a circle, and upright walls below it
    across, up = (RADIUS - behind) * np.sin(turn), (RADIUS - behind) * np.cos(turn) - (np.abs(arc) - RADIUS * np.abs(turn))
    under = (row < WALLS[0]) | (row >= WALLS[1])
    across[under], up[under] = floor(place[under], len(grey), pixel)
    xyz = PLACE + np.column_stack([along, -across, up]) + rng.normal(0.0, 0.001, (len(row), 3))
    las = laspy.create(point_format=6, file_version="1.4")
    las.header.offsets, las.header.scales = PLACE, [0.0001] * 3
    las.add_extra_dim(laspy.ExtraBytesParams("Reflectance", np.float32))
    las.x, las.y, las.z = xyz.T
    las.Reflectance = (grey[row, column] * STEP).astype(np.float32)
    las.write(path)


def floor(place: np.ndarray, rows: int, pixel: float) -> tuple[np.ndarray, np.ndarray]:
    """Place rows of track and walkway across the tunnel: the track at the foot of one wall, a walkway at that of the other."""
    right, left = (np.pi / 2 * RADIUS - abs(rows / 2 - edge) * pixel for edge in WALLS)
    corners = np.array([[RADIUS, right], [-WALKWAY, right], [-WALKWAY, left], [-RADIUS, left]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    count = rows - WALLS[1] + WALLS[0]
    share = (WALLS[0] - place) % rows / count * way[-1]
    return np.interp(share, way, corners[:, 0]), np.interp(share, way, corners[:, 1])


def outlines(mask: np.ndarray, pixel: float) -> list[shapely.Geometry]:
    """Outlines of what is wet in the unrolled plane (chainage, arc), m."""
    transform = Affine(pixel, 0.0, 0.0, 0.0, -pixel, len(mask) / 2 * pixel)
    found = rasterio.features.shapes(mask.astype(np.uint8), mask=mask, connectivity=8, transform=transform)
    return [shapely.make_valid(shape(one).simplify(SIMPLE)) for one, _ in found]


if __name__ == "__main__":
    main()
