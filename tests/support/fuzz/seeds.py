"""Small right files of every kind, from which wrong ones are made."""

from __future__ import annotations

import json
from pathlib import Path

import ezdxf
import laspy
import numpy as np
import rasterio
from affine import Affine

from support.e57_files import Scan, write
from tunneldb.geometry.surface import Surface

DATA = Path(__file__).parents[2] / "data"
RATING = Path(__file__).parents[3] / "docs" / "examples" / "rating-example.toml"


def write_seeds(folder: Path, axis: np.ndarray, surface: Surface) -> None:
    """Write a file of each kind for the example survey.

    Parameters
    ----------
    folder : Path
        Of the files.
    axis : (n, 3) float array
        Vertices of the tunnel's axis, m.
    surface : Surface
        Of the survey's measured axis.
    """
    rows = "\n".join(",".join(f"{value:.3f}" for value in vertex) for vertex in axis)
    _write(folder / "axis.csv", "x,y,z\n" + rows)
    _write(
        folder / "stations.csv",
        "scan_id,x,y,z\n" + "\n".join(f"{n},{x:.3f},{y:.3f},{z:.3f}" for n, (x, y, z) in enumerate(axis)),
    )
    _write(
        folder / "trajectory.csv",
        "time,x,y,z\n" + "\n".join(f"{10.5 * n},{x:.3f},{y:.3f},{z:.3f}" for n, (x, y, z) in enumerate(axis)),
    )
    _write(
        folder / "reference.csv",
        "range_m,intensity_db\n" + "\n".join(f"{r},{20 - 20 * np.log10(r):.3f}" for r in (1, 2, 4, 8, 16)),
    )
    _write(folder / "equations.csv", "chainage,station\n12300,500.000\n12400.5,600.000")
    _write(
        folder / "control.csv",
        "id,x,y,z\n" + "\n".join(f"P{n},{x:.3f},{y:.3f},{z:.3f}" for n, (x, y, z) in enumerate(axis[::4])),
    )
    _write(folder / "profile.csv", "right,up,radius\n-5,-2,0\n-5,0,5\n5,0,0\n5,-2,0")
    _write(
        folder / "profile.txt",
        "# right up\n" + "\n".join(f"{5 * np.cos(a):.4f} {5 * np.sin(a):.4f}" for a in np.linspace(0, 6.2, 60)),
    )
    _write(
        folder / "findings.csv",
        "kind,chainage,arc,remark\nobstruction,12330.5,1.25,wet\nother,12350,-2.5,\nobstruction,12360.25,0,old",
    )
    _write(folder / "rings.csv", "number,chainage_from,chainage_to\n1,12320,12321.5\n2,12321.5,12323")
    _write(
        folder / "ladders.csv",
        "ladder,rung,height,stile_gap,diameter\n" + "\n".join(f"A,{n},{599 + 0.3 * n:.2f},0.4,0.03" for n in range(6)),
    )
    _write(folder / "start.csv", f"file,x,y,within\npoints.csv,{axis[5][0]:.1f},{axis[5][1]:.1f},3")
    _write(folder / "elements.csv", "name,chainage_from,chainage_to,clock_from,clock_to\nvault,12300,12350,9,3\n")
    _write(folder / "rating.toml", RATING.read_text("utf-8"))
    _write(
        folder / "actions.csv",
        "id,survey,chainage_from,chainage_to,measure,due,cost,currency\n,demo-2024,12310,12312,seal,2030-01-31,12.5,EUR\n",
    )
    _write(
        folder / "signed.html",
        '<script type="application/json" id="record">{"survey": "demo-2024", "low": 12300.0, "high": 12500.0, "at":'
        ' "2999-01-01T00:00:00+00:00", "digest": "0123456789abcdef", "leaks": true, "listed": 1000, "ratings": []}</script>',
    )
    _write(folder / "template.toml", 'client = "Owner"\nlanguage = "de"\n\n[headings]\n"Leak" = "Wasserzutritt"\n')
    for name in ("points", "axis"):
        lines = (DATA / "wriggle" / f"{name}.csv").read_text().splitlines()[: 60 if name == "points" else None]
        _write(folder / f"rings-{name}.csv", "\n".join(lines))
    points = _points(surface)
    text = [f"{x:.3f},{y:.3f},{z:.3f},{i}" for (x, y, z), i in zip(points, range(len(points)), strict=True)]
    _write(folder / "points.csv", "x,y,z,intensity\n" + "\n".join(text))
    _write(folder / "cloud.ptx", _ptx(points, axis[5]))
    _write(folder / "cloud.ply", _ply(points))
    _las(folder / "cloud.las", points)
    _las(folder / "cloud.laz", points)
    _e57(folder / "cloud.e57", points)
    _drawing(folder / "axis.dxf", axis)
    _outline(folder / "profile.dxf")
    _truth(folder / "truth.geojson")
    _images(folder)
    for sample in ("j-landxml.xml", "indot-twin-branch.xml", "aplitop-3.ifc", "indot-twin-branch.ifc"):
        (folder / sample).write_bytes((DATA / sample).read_bytes())


def _write(path: Path, text: str) -> None:
    path.write_text(text + "\n", encoding="utf-8")


def _points(surface: Surface) -> np.ndarray:
    chance = np.random.default_rng(1)
    points = surface.to_space(chance.uniform(12_320, 12_330, 800), chance.uniform(-4, 4, 800), chance.normal(0, 0.003, 800))
    return np.asarray(points[np.isfinite(points[:, 0])])


def _ptx(points: np.ndarray, station: np.ndarray) -> str:
    x, y, z = station
    head = f"20\n10\n{x:.3f} {y:.3f} {z:.3f}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{x:.3f} {y:.3f} {z:.3f} 1"
    points = points - station
    return head + "\n" + "\n".join(f"{x:.3f} {y:.3f} {z:.3f} 0.5" for x, y, z in points[:200])


def _ply(points: np.ndarray) -> str:
    head = "ply\nformat ascii 1.0\nelement vertex 200\nproperty double x\nproperty double y\nproperty double z\nend_header"
    return head + "\n" + "\n".join(f"{x:.3f} {y:.3f} {z:.3f}" for x, y, z in points[:200])


def _las(path: Path, points: np.ndarray) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.001), points[0].round()
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = points.T
    cloud.intensity = np.arange(len(points)) % 5000
    cloud.gps_time = np.linspace(0, 40, len(points))
    cloud.write(path)


def _e57(path: Path, points: np.ndarray) -> None:
    fields = {f"cartesian{axis}": points[:, k] - points[0, k] for k, axis in enumerate("XYZ")}
    write(path, [Scan(fields | {"intensity": np.linspace(0, 1, len(points))}, translation=points[0].tolist())])


def _drawing(path: Path, axis: np.ndarray) -> None:
    document = ezdxf.new(units=6)
    document.modelspace().add_polyline3d([tuple(vertex) for vertex in axis.tolist()])
    document.saveas(path)


def _outline(path: Path) -> None:
    document = ezdxf.new(units=6)
    document.modelspace().add_lwpolyline([(-5, -2, 0), (-5, 0, -1), (5, 0, 0), (5, -2, 0)], format="xyb")
    document.saveas(path)


def _truth(path: Path) -> None:
    ring = [[12_318, 1], [12_319, 1], [12_319, 2], [12_318, 2], [12_318, 1]]
    shape = {"type": "Polygon", "coordinates": [ring]}
    feature = {"type": "Feature", "properties": {"kind": "leak", "area": 1.0}, "geometry": shape}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))


def _images(folder: Path) -> None:
    """A thermal image in chainage and arc, its control points, and a table that has it as a frame."""
    values = (10 + np.arange(60 * 200) % 97 / 10).reshape(1, 60, 200).astype(np.float32)
    with rasterio.open(
        folder / "strip.tif", "w", driver="GTiff", width=200, height=60, count=1, dtype="float32",
        transform=Affine(0.1, 0.0, 12320.0, 0.0, -0.1, 3.0),
    ) as image:  # fmt: skip
        image.write(values)
        image.units = ("°C",)
    points = [(10, 10), (190, 12), (100, 55), (15, 50), (180, 48)]
    _write(
        folder / "image-points.csv",
        "column,row,chainage,arc\n" + "\n".join(f"{c},{r},{12320 + 0.1 * c:.3f},{3 - 0.1 * r:.3f}" for c, r in points),
    )
    cracks = np.zeros((60, 200), np.uint8)
    cracks[30:32, 20:180] = 255
    with rasterio.open(folder / "mask.png", "w", driver="PNG", width=200, height=60, count=1, dtype="uint8") as image:
        image.write(cracks[None])
    (folder / "mask-points.csv").write_bytes((folder / "image-points.csv").read_bytes())
    _write(folder / "frames.csv", f"file,chainage_from,chainage_to,arc_from,arc_to\n{folder / 'strip.tif'},12320,12340,-3,3\n")
