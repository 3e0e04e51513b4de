"""Reference data of the lining as polygons: wet areas, and dry dark areas."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pyogrio.raw
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from tunneldb.arrays import Float
from tunneldb.simulate.lining.leaks import Leak
from tunneldb.simulate.lining.reflectance import GRIME_RISE, Reflectance, soot_amount
from tunneldb.simulate.lining.relief import wider_from
from tunneldb.simulate.lining.rings import POCKET, POCKET_FROM_JOINT, POCKETS, Rings

if TYPE_CHECKING:
    from tunneldb.simulate.generate import Simulation


SOOT_STEP = 1.0  # m between the vertices of soot
ARC_STEP = 0.005  # m between points for measuring arcs on a wider section


class Dry(NamedTuple):
    """Dry dark area on the lining: outline in the unrolled plane (m), kind, darkening (dB)."""

    outline: Polygon
    kind: str
    drop: float


def as_built(simulation: Simulation) -> Callable[[BaseGeometry], BaseGeometry]:
    """Return a function that maps outlines on the nominal lining to the built one, whose arcs are longer where it is wider."""
    parameters, tunnel = simulation.parameters, simulation.tunnel
    if not parameters.radius_step:
        return lambda outline: outline
    wider = wider_from(tunnel)
    half = np.linspace(0.0, tunnel.section.floor_arc, math.ceil(tunnel.section.floor_arc / ARC_STEP) + 1)

    def length(arc: Float) -> Float:
        point, normal = tunnel.section.point(arc)
        pieces = np.diff(point - parameters.radius_step * normal, axis=0)
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(pieces, axis=1))])

    arcs, lengths = np.concatenate([-half[:0:-1], half]), np.concatenate([-length(-half)[:0:-1], length(half)])

    def lay(places: Float) -> Float:
        s, arc = places.T
        return np.column_stack([s, np.where(s > wider, np.interp(arc, arcs, lengths), arc)])

    return lambda outline: shapely.transform(outline, lay)


def leaks_as_built(simulation: Simulation) -> list[Leak]:
    """Return leaks with their outlines on the built lining."""
    lay = as_built(simulation)
    return [replace(leak, polygon=lay(leak.polygon)) for leak in simulation.leaks]


def joints(rings: Rings, start: float, end: float, lowest: float) -> list[Dry]:
    """Return joints of the lining and bolt pockets from chainage ``start`` to ``end``, up to ``lowest`` m from the crown."""
    dry = []
    n, m = rings.seam_width.shape
    half = 0.5 * m * rings.period
    for j in range(n + 1 if rings.length else 0):
        s, width = rings.first + j * rings.length, 0.5 * rings.joint_width[j]
        dry.append(Dry(box(s - width, -lowest, s + width, lowest), "joint", float(rings.joint_drop[j])))
    for i in range(n):
        begin = rings.first + i * rings.length
        middle = begin + POCKET_FROM_JOINT
        for k in range(m):
            seam = rings.shift[i] + k * rings.period
            arc = (seam + half) % (2.0 * half) - half
            width = 0.5 * rings.seam_width[i, k]
            outline = box(begin, arc - width, begin + rings.length, arc + width)
            dry.append(Dry(outline, "joint", float(rings.seam_drop[i, k])))
            for share, drop in zip(POCKETS, rings.pocket_drop[i, k].tolist(), strict=True):
                arc = (seam + share * rings.period + half) % (2.0 * half) - half
                outline = box(middle - 0.5 * POCKET[0], arc - 0.5 * POCKET[1], middle + 0.5 * POCKET[0], arc + 0.5 * POCKET[1])
                dry.append(Dry(outline, "pocket", drop))
    lining = box(start, -lowest, end, lowest)
    cut = [d._replace(outline=d.outline.intersection(lining)) for d in dry]
    return [d for d in cut if d.outline.area > 0.0]


def soot(reflectance: Reflectance, start: float, end: float) -> list[Dry]:
    """Return areas darkened by at least half of the requested soot; the darkening is the mean over the area."""
    asked, middle, width = reflectance.soot.tolist()
    if asked == 0.0:
        return []
    s = np.linspace(start, end, max(2, math.ceil((end - start) / SOOT_STEP) + 1))
    amount = soot_amount(reflectance, s)
    half = width * np.sqrt(np.log(np.maximum(2.0 * amount, 1.0 + 1e-9)))
    outline = Polygon(np.vstack([np.column_stack([s, middle - half]), np.column_stack([s, middle + half])[::-1]]))
    across = np.linspace(0.0, 1.0, 51) * half[:, None]
    level = asked * amount[:, None] * np.exp(-((across / width) ** 2))
    return [Dry(outline, "soot", float(np.average(level.mean(axis=1), weights=half)))]


def grime(reflectance: Reflectance, start: float, end: float) -> list[Dry]:
    """Return areas darkened by at least half of the greatest grime, on average along the tunnel, with their mean darkening."""
    dry = []
    for side, edge, fade, drop in reflectance.grime.tolist():
        low, high = sorted((side * (edge - 0.5 * GRIME_RISE), side * (edge + fade * math.log(2.0))))
        dry.append(Dry(box(start, low, end, high), "grime", 0.75 * drop))
    return dry


def _painted(simulation: Simulation) -> list[tuple[BaseGeometry, str, float]]:
    """Return outline on the lining, kind and level (dB) of marks and blotches."""
    line, lowest = simulation.tunnel.line, simulation.tunnel.section.floor_arc
    lining = box(line.start, -lowest, line.end, lowest)
    all_of_them = [(m.polygon(), m.kind, m.level) for m in simulation.marks]
    all_of_them += [(b.polygon(), b.kind, b.level) for b in simulation.blotches]
    inside = [(o if lining.contains(o) else o.intersection(lining), kind, level) for o, kind, level in all_of_them]
    return [row for row in inside if row[0].area > 0.0]


def dry_features(simulation: Simulation) -> list[Dry]:
    """Return all dry dark areas on the lining."""
    line, lowest = simulation.tunnel.line, simulation.tunnel.section.floor_arc
    dry = joints(simulation.rings, line.start, line.end, lowest)
    dry += [Dry(outline, kind, -level) for outline, kind, level in _painted(simulation) if level < 0.0]
    if simulation.reflectance is not None:
        dry += soot(simulation.reflectance, line.start, line.end) + grime(simulation.reflectance, line.start, line.end)
    return dry


def bright_features(simulation: Simulation) -> list[Dry]:
    """Return marks and blotches brighter than the lining; their darkening is negative."""
    return [Dry(outline, kind, -level) for outline, kind, level in _painted(simulation) if level > 0.0]


def write_truth(simulation: Simulation, path: Path) -> None:
    """Write leaks and dry dark areas as layers ``leak`` and ``dry`` of a GeoPackage, in the unrolled plane as built.

    Bright areas, if any, are in a layer ``bright`` with the same columns; lining that was deformed since the first scan is in a
    layer ``deformation``.
    """
    lay, leaks = as_built(simulation), leaks_as_built(simulation)
    dry, bright = ([d._replace(outline=lay(d.outline)) for d in f(simulation)] for f in (dry_features, bright_features))
    wet = {
        "id": np.array([k.id for k in leaks], dtype=np.int32),
        "kind": np.array([k.kind for k in leaks], dtype=object),
        "area": np.array([k.area for k in leaks], dtype=np.float64),
        "drop_db": np.array([k.drop for k in leaks], dtype=np.float64),
    }
    _write_layer(path, "leak", [k.polygon for k in leaks], wet, append=False)
    for layer, features in (("dry", dry), ("bright", bright)):
        columns = {
            "kind": np.array([d.kind for d in features], dtype=object),
            "drop_db": np.array([d.drop for d in features], dtype=np.float64),
        }
        if features or layer == "dry":
            _write_layer(path, layer, [d.outline for d in features], columns, append=True)
    if simulation.epoch is not None and simulation.epoch.deformations:
        moved = simulation.epoch.deformations
        columns = {
            "kind": np.array([d.kind for d in moved], dtype=object),
            "change": np.array([d.change for d in moved], dtype=np.float64),
        }
        _write_layer(path, "deformation", [d.outline for d in moved], columns, append=True)


def _write_layer(path: Path, layer: str, outlines: list[BaseGeometry], columns: dict[str, NDArray], append: bool) -> None:  # type: ignore[type-arg]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the unrolled plane has none
        pyogrio.raw.write(
            str(path),
            shapely.to_wkb(np.array([shapely.geometry.MultiPolygon(getattr(o, "geoms", [o])) for o in outlines], dtype=object)),
            list(columns.values()),
            np.array(list(columns), dtype=object),
            layer=layer,
            driver="GPKG",
            geometry_type="MultiPolygon",
            append=append,
        )
