"""Target spheres of a survey: found in its scan files at full density, kept in tunnel.target_sphere."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import psycopg
from numpy.typing import NDArray

from tunneldb.arrays import Bool, Float
from tunneldb.classification.targets.curvature import CurvedCells
from tunneldb.classification.targets.detection import MIN_POINTS, Refusal, Sphere, confirmed, find_spheres, join
from tunneldb.database import snapshot
from tunneldb.errors import NotReadyError, UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.pointcloud.reader import CHUNK, Points, ScanSource, read_chunks
from tunneldb.pointcloud.spool import BINS_PER_METRE, Spool, bin_of, windows
from tunneldb.progress import StartProgress
from tunneldb.stages.ledger import stage_run
from tunneldb.stages.run import loaded_kilometres
from tunneldb.store.poses import load_poses
from tunneldb.store.scene import line_of, load_ground, save_spheres
from tunneldb.store.sources import sources
from tunneldb.store.surface import load_alignment, load_surface
from tunneldb.store.survey import Survey

MEMORY = 256 << 20  # of points that wait to be looked at; beyond, they wait on disk
WINDOW = 1_000_000  # points looked at at a time
WINDOW_MARGIN = 1.0  # m; a window reaches so far into its neighbours, for spheres on its ends

_KEPT = np.dtype([("xyz", "f8", (3,)), ("eye", "f8", (3,)), ("chainage", "f8"), ("scan", "i4")])


@dataclass(frozen=True)
class TargetObservation:
    """A target sphere as one scan saw it: a row of tunnel.target_sphere.

    Attributes
    ----------
    number : int
        The same for all scans that saw it; along the tunnel, from 1.
    scan : int
        Scan that saw it.
    km : int
        Kilometre of its centre.
    chainage : float or None
        Chainage of its centre, m; None if the tunnel has no segment.
    sphere : Sphere
    """

    number: int
    scan: int
    km: int
    chainage: float | None
    sphere: Sphere


@dataclass(frozen=True)
class Search:
    """Result of a search.

    Attributes
    ----------
    spheres : list of TargetObservation
        By number and scan.
    refusals : list of (int, Refusal)
        Rejected candidates, and the scans that saw them.
    points : int
        Points read.
    """

    spheres: list[TargetObservation]
    refusals: list[tuple[int, Refusal]]
    points: int


def search(
    conn: psycopg.Connection[Any],
    survey: Survey,
    radius: float,
    tolerance: float,
    begin: StartProgress,
) -> Search:
    """Find the target spheres of a survey in its scan files, and put them in the place of those found before.

    The files are read twice, kilometre by kilometre: once for parts that are not flat, once for the points there, without those
    on the ground if stage ``ground`` has run. Results are written in one short transaction.

    Parameters
    ----------
    conn : Connection
        Idle.
    survey : Survey
    radius, tolerance : float
        Nominal radius, and how far the fitted one may be from it, m.
    begin : callable
        Called with a step's name and its points; returns a function that takes the points done.

    Raises
    ------
    UserError
        If nothing is loaded, a file is gone or was changed, or cannot be read.
    """
    with snapshot(conn):
        kilometres = loaded_kilometres(conn, survey)
        place = _Place.of(conn, survey) if kilometres else None
    if place is None:
        raise NotReadyError(f"survey {survey.name} holds no points yet: tunneldb load {survey.name} FILE...")
    rows: list[TargetObservation] = []
    refusals: list[tuple[int, Refusal]] = []
    points = 0
    for km in kilometres:
        with snapshot(conn):
            files = sources(conn, survey, km)
            kilometre = _Kilometre(place, km, files, radius, tolerance, _ground_of(conn, survey, km))
        points += sum(file.points for file in files)
        found, refused = kilometre.search(begin)
        rows += found
        refusals += refused
    rows, weak = _numbered(rows, radius, place)
    refusals += weak
    # Begun only now: while files are read, batches of the survey go on.
    with stage_run(conn, survey.id, None, "spheres", {"radius": radius, "tolerance": tolerance}) as run:
        found_spheres = [(row.km, row.number, row.scan, row.chainage, row.sphere) for row in rows]
        save_spheres(conn, survey, found_spheres, radius)
        run.counts.update(
            kilometres=len(kilometres),
            points_read=points,
            spheres=len({row.number for row in rows}),
            rows=len(rows),
            refused=len(refusals),
        )
    return Search(rows, refusals, points)


@dataclass(frozen=True)
class _Place:
    """Return the places of points along the tunnel, and the scanner positions."""

    alignment: Alignment
    surface: Surface | None
    poses: PoseModel | None

    @classmethod
    def of(cls, conn: psycopg.Connection[Any], survey: Survey) -> _Place:
        return cls(load_alignment(conn, survey), _if_there(load_surface, conn, survey), _if_there(load_poses, conn, survey))

    def chainage(self, centre: Float) -> tuple[float, float | None]:
        """Return the chainage of a centre by the given axis, NaN beyond its ends; and by the segments, if available."""
        given = float(self.alignment.chainage(centre[None])[0])
        if self.surface is None:
            return given, None
        found = float(self.surface.unroll(centre[None]).chainage[0])
        return given, None if np.isnan(found) else found

    def observers(self, points: Points) -> Float:
        """Return the scanner position for each point (n, 3), m; NaN if unknown."""
        return np.full((len(points), 3), np.nan) if self.poses is None or self.poses.empty else self.poses.positions(points)


def _if_there(load: Callable[..., Any], conn: psycopg.Connection[Any], survey: Survey) -> Any:
    """Call a loader; return None if its result does not exist. A search needs only points."""
    try:
        return load(conn, survey)
    except UserError:
        return None


def _ground_of(conn: psycopg.Connection[Any], survey: Survey, km: int) -> Callable[[Float], Bool] | None:
    """Return the classifier of ground points of a kilometre; None before stage ``ground``."""
    first, stop = km * KILOMETRE - 10.0, (km + 1) * KILOMETRE + 10.0
    ground = load_ground(conn, survey, first, stop)
    if ground is None:
        return None
    line = line_of(load_surface(conn, survey, first, stop))

    def on_ground(xyz: Float) -> Bool:
        along, across = line.place(xyz)
        return ground.is_ground(along, across, xyz[:, 2])

    return on_ground


@dataclass(frozen=True)
class _Kilometre:
    """The search in one kilometre."""

    place: _Place
    km: int
    files: list[ScanSource]
    radius: float
    tolerance: float
    on_ground: Callable[[Float], Bool] | None

    def search(self, begin: StartProgress) -> tuple[list[TargetObservation], list[tuple[int, Refusal]]]:
        total = sum(file.points for file in self.files)
        curved = CurvedCells(self.radius, MIN_POINTS)
        step = begin(f"km {self.km}: parts that are not flat", total)
        for points in self._chunks():
            curved.add(points.xyz)
            step(len(points))
        curved.close()
        step = begin(f"km {self.km}: spheres", total)
        found: list[TargetObservation] = []
        refused: list[tuple[int, Refusal]] = []
        with Spool(MEMORY, _KEPT) as spool:
            for points in self._chunks():
                spool.add(self._kept(points, curved))
                step(len(points))
            del curved
            first, counts = spool.counts()
            for low, high in windows(first, counts, WINDOW):
                beside = int(WINDOW_MARGIN * BINS_PER_METRE)
                rows = spool.read(low - beside, high + beside)
                for scan in np.unique(rows["scan"]):
                    one = rows[rows["scan"] == scan]
                    spheres, refusals = find_spheres(one["xyz"], one["eye"], self.radius, self.tolerance)
                    for sphere in spheres:
                        given, chainage = self.place.chainage(sphere.centre)
                        if self._is_ours(given, low, high):
                            found.append(TargetObservation(0, int(scan), self.km, chainage, sphere))
                    refused += [
                        (int(scan), refusal)
                        for refusal in refusals
                        if self._is_ours(self.place.chainage(refusal.centre)[0], low, high)
                    ]
        return found, refused

    def _chunks(self) -> Iterator[Points]:
        for file in self.files:
            yield from read_chunks(file.path, None, CHUNK, file.ranges, units=file.units)

    def _kept(self, points: Points, curved: CurvedCells) -> NDArray[Any]:
        points = points.some(curved.holds(points.xyz))
        if self.on_ground is not None:
            points = points.some(~self.on_ground(points.xyz))
        chainage = self.place.alignment.chainage(points.xyz)
        inside = np.isfinite(chainage)
        points = points.some(inside)
        rows = np.empty(len(points), _KEPT)
        rows["xyz"], rows["eye"], rows["scan"] = points.xyz, self.place.observers(points), points.scan_id
        rows["chainage"] = chainage[inside]
        return rows

    def _is_ours(self, chainage: float, low: int, high: int) -> bool:
        """Return True if a chainage is in a window of bins, and in this kilometre: its neighbours see the same sphere."""
        if np.isnan(chainage) or chainage // KILOMETRE != self.km:
            return False
        return low <= int(bin_of(np.array([chainage]))[0]) < high


def _numbered(
    rows: list[TargetObservation], radius: float, place: _Place
) -> tuple[list[TargetObservation], list[tuple[int, Refusal]]]:
    """Return rows with the numbers of their spheres, along the tunnel, by number and scan; and poorly seen candidates."""
    if not rows:
        return rows, []
    centres = np.array([row.sphere.centre for row in rows])
    group = join(centres, np.array([row.scan for row in rows]), radius)
    good = confirmed(group, np.array([row.sphere.firm for row in rows]))
    weak = [
        (row.scan, Refusal(row.sphere.centre, row.sphere.points, "too few points, and no other scan saw it better"))
        for row, sure in zip(rows, good, strict=True)
        if not sure
    ]
    rows, group, centres = [row for row, sure in zip(rows, good, strict=True) if sure], group[good], centres[good]
    if not rows:
        return rows, weak
    group = np.unique(group, return_inverse=True)[1]
    middle = np.bincount(group, place.alignment.chainage(centres)) / np.bincount(group)
    rank = np.empty(len(middle), np.int64)
    rank[np.lexsort((np.arange(len(middle)), middle))] = np.arange(1, len(middle) + 1)
    numbered = [replace(row, number=int(rank[group[k]])) for k, row in enumerate(rows)]
    return sorted(numbered, key=lambda row: (row.number, row.scan)), weak
