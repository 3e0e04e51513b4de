"""A survey of a tunnel: what is scanned, what an inspector would draw, and the files that are handed over."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path

import laspy
import numpy as np
import pyproj
import shapely
from scipy import ndimage
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Cloud, Instrument, Sweep, observe
from benchmarks.blind.round_08.surface import Mask, Surface, Wet
from benchmarks.blind.round_08.tunnel import Array, Axis, Section

CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
# What a cable or a pipe hides belongs to a leak if the strip is no wider than this, in metres.
HIDDEN = 0.15


@dataclass
class Survey:
    """Everything that a scene is made of.

    Attributes
    ----------
    axis, section, surface, fittings, instrument :
        The tunnel and the scanner.
    sweeps : list of Sweep
        Stations, or one drive.
    density : float
        Points per square metre that each sweep is thinned to.
    reference : tuple of float, optional
        Level of a target of known reflectance and the longest range at which it was measured.
    """

    axis: Axis
    section: Section
    surface: Surface
    fittings: Fittings
    instrument: Instrument
    sweeps: list[Sweep]
    density: float
    reference: tuple[float, float] | None = None


@dataclass
class Drawn:
    """A leak as it is drawn: outline in chainage and girth, drop in dB."""

    phenomenon: str
    outline: BaseGeometry
    drop: float
    limit: str | None


def scan(survey: Survey) -> Cloud:
    """Scan from all stations."""
    parts = [
        observe(sweep, survey.axis, survey.section, survey.surface, survey.fittings, survey.instrument, survey.density)
        for sweep in survey.sweeps
    ]
    return Cloud(*(np.concatenate([getattr(part, name.name) for part in parts]) for name in fields(Cloud)))


def outline(mask: Mask, step: float, smallest: float = 0.012) -> BaseGeometry:
    """Outline of a mask in chainage and girth: crumbs left out, small holes filled, corners rounded."""
    padded = np.pad(mask, ((0, 0), (1, 1)))
    change = np.diff(padded.astype(np.int8), axis=1)
    rows, starts = np.nonzero(change == 1)
    _, ends = np.nonzero(change == -1)
    whole = shapely.union_all(shapely.box(rows * step, starts * step, (rows + 1) * step, ends * step))
    whole = whole.buffer(step).buffer(-2.0 * step).buffer(step)
    parts = whole.geoms if isinstance(whole, MultiPolygon) else [whole]
    kept = [
        Polygon(part.exterior, [ring for ring in part.interiors if Polygon(ring).area > 0.03])
        for part in parts
        if part.area >= smallest
    ]
    return shapely.segmentize(shapely.union_all(kept).simplify(0.006), 0.035)


def _seen(survey: Survey, cloud: Cloud) -> Mask:
    """Cells of the lining that the scanner saw, strips hidden by cables and pipes filled."""
    surface, coarse = survey.surface, 2
    shape = tuple(-(-size // coarse) for size in surface.shape)
    i, j = surface.index(cloud.s[cloud.lining], cloud.u[cloud.lining])
    hit = np.zeros(shape, bool)
    hit[i // coarse, j // coarse] = True
    size = round(HIDDEN / (coarse * surface.step))
    hit = ndimage.binary_closing(np.pad(hit, size), np.ones((size, size)))[size:-size, size:-size]
    return np.kron(hit, np.ones((coarse, coarse), bool))[: surface.shape[0], : surface.shape[1]]


def _joined(wets: list[Wet]) -> list[Wet]:
    """Wet places by what water joins, each under the name of what has most of it."""
    if not wets:
        return []
    whole = np.logical_or.reduce([wet.mask for wet in wets])
    label, count = ndimage.label(ndimage.binary_dilation(whole, iterations=2), np.ones((3, 3)))
    label = np.where(whole, label, 0)
    shares = np.stack([np.bincount(label[wet.mask], minlength=count + 1) for wet in wets])
    together = []
    for number in range(1, count + 1):
        share = shares[:, number]
        most = wets[int(share.argmax())]
        together.append(Wet(most.phenomenon, label == number, most.limit))
    return together


def draw(survey: Survey, cloud: Cloud) -> list[Drawn]:
    """Draw the leaks that the points show, and measure their drop on the points."""
    surface = survey.surface
    wets = _joined(surface.wets)
    seen = _seen(survey, cloud)
    s, u, level = cloud.s[cloud.lining], cloud.u[cloud.lining], cloud.level[cloud.lining]
    cell = surface.index(s, u)
    whole = np.logical_or.reduce([wet.mask for wet in wets]) if wets else np.zeros(surface.shape, bool)
    away = ~ndimage.binary_dilation(whole, iterations=int(0.08 / surface.step))
    drawn = []
    for wet in wets:
        if not np.any(wet.mask & seen):
            continue
        shape = outline(wet.mask & seen, surface.step)
        if shape.is_empty:
            continue
        west, south, east, north = shape.bounds
        near = np.flatnonzero((s > west - 3.0) & (s < east + 3.0) & (u > south - 3.0) & (u < north + 3.0))
        inner = near[shapely.contains_xy(shape, s[near], u[near])]
        # Like is compared with like: what lies in soot with soot, what does not with lining that is clean.
        alike = away.copy()
        for _, mask in surface.others:
            alike &= mask if np.count_nonzero(mask & wet.mask) > 0.5 * np.count_nonzero(wet.mask) else ~mask
        rest = near[alike[cell[0][near], cell[1][near]]]
        for width in (0.5, 1.2, 3.0):
            dry = rest[shapely.contains_xy(shape.buffer(width), s[rest], u[rest])]
            if dry.size > 200:
                break
        if inner.size < 5 or dry.size < 50:
            raise ValueError(f"{wet.phenomenon} at {west:.1f}, {south:.1f}: too few points to measure its drop")
        drawn.append(Drawn(wet.phenomenon, shape, float(level[dry].mean() - level[inner].mean()), wet.limit))
    return drawn


def _lift(survey: Survey, ring: Array) -> list[list[float]]:
    """Coordinates of a ring on the lining."""
    s, u = np.asarray(ring)[:, 0], np.asarray(ring)[:, 1]
    h, v, normal_h, normal_v = survey.section.at(np.minimum(u, survey.section.lined))
    out = survey.surface.relief[survey.surface.index(s, u)]
    xyz = survey.axis.to_local(s, h - out * normal_h, v - out * normal_v) + np.array(survey.axis.origin)
    return np.round(xyz, 4).tolist()


def _geojson(path: Path, survey: Survey, shapes: list[tuple[BaseGeometry, dict]]) -> None:
    """Write outlines and their properties."""
    features = []
    for shape, properties in shapes:
        parts = shape.geoms if isinstance(shape, MultiPolygon) else [shape]
        rings = [[_lift(survey, ring.coords) for ring in (part.exterior, *part.interiors)] for part in parts]
        kind, coordinates = ("Polygon", rings[0]) if len(rings) == 1 else ("MultiPolygon", rings)
        geometry = {"type": kind, "coordinates": coordinates}
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": CRS, "features": features}), encoding="utf-8")


def _points(path: Path, survey: Survey, cloud: Cloud) -> None:
    """Write the points."""
    xyz = cloud.xyz + np.array(survey.axis.origin)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.0005), np.floor(xyz.min(axis=0))
    header.add_crs(pyproj.CRS.from_epsg(25832))
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "float32"))
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.gps_time, las.point_source_id = cloud.time, cloud.scan.astype(np.uint16)
    las["Amplitude"] = cloud.amplitude.astype(np.float32)
    las.return_number = las.number_of_returns = np.ones(len(xyz), np.uint8)
    las.write(str(path))


def _table(path: Path, head: str, rows: Array, form: str) -> None:
    """Write a table."""
    np.savetxt(path, rows, fmt=form, delimiter=",", header=head, comments="")


def hand_over(survey: Survey, folder: Path, cloud: Cloud, leaks: list[Drawn]) -> None:
    """Write all files of a scene."""
    axis, surface, origin = survey.axis, survey.surface, np.array(survey.axis.origin)
    _points(folder / "scan.laz", survey, cloud)
    chainage = np.arange(-4.0, surface.length + 7.9, 4.0)
    middle = axis.to_local(chainage, 0.0, survey.section.centre_height) + origin
    _table(folder / "axis.csv", "x,y,z", middle, "%.3f")
    first = survey.sweeps[0]
    if first.moving:
        every = max(1, int(0.05 / np.diff(first.time).mean()))
        rows = np.column_stack([first.time, first.origin + origin])[::every]
        _table(folder / "trajectory.csv", "time,x,y,z", rows, "%.4f")
    else:
        rows = np.array([[sweep.scan, *(sweep.origin[0] + origin)] for sweep in survey.sweeps])
        _table(folder / "stations.csv", "scan_id,x,y,z", rows, "%d,%.4f,%.4f,%.4f")
    if survey.reference is not None:
        level, longest = survey.reference
        ranges = np.arange(1.5, longest + 0.1, 0.5)
        target = survey.instrument.law(ranges) + level + surface.rng.normal(0.0, 0.06, ranges.size)
        _table(folder / "reference.csv", "range_m,intensity_db", np.column_stack([ranges, target]), "%.3f")
    shapes = []
    for number, leak in enumerate(leaks, 1):
        properties = {"id": number, "drop_db": round(leak.drop, 2), "phenomenon": leak.phenomenon}
        shapes.append((leak.outline, properties | ({"limit": leak.limit} if leak.limit else {})))
    _geojson(folder / "truth.geojson", survey, shapes)
    others = [(outline(mask, surface.step), {"kind": kind}) for kind, mask in surface.others if mask.any()]
    _geojson(folder / "other.geojson", survey, [(shape, properties) for shape, properties in others if not shape.is_empty])


def make(survey: Survey, folder: Path) -> None:
    """Scan, draw and write."""
    cloud = scan(survey)
    hand_over(survey, folder, cloud, draw(survey, cloud))
