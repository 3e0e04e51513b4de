"""The axis of a tunnel from its scan files, without a database."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pyproj import CRS

from tunneldb.alignment.found import FoundAxis, find_axis, follow_line, without_haze
from tunneldb.alignment.given import GivenAxis
from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.geometry.crs import describe_crs, in_metres, plan_unit
from tunneldb.geometry.crs_equality import same_horizontally
from tunneldb.geometry.stationing import chainage_label
from tunneldb.pointcloud.contents import UniformSample
from tunneldb.pointcloud.form import tunnel_form
from tunneldb.pointcloud.formats.raw import read_raw
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.reader import ScanHeader, check_header, read_header
from tunneldb.pointcloud.units import NOT_GIVEN, GivenUnits, in_units, require_metres
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.progress import StartProgress

EDGE = 0.5
"""Edge of the voxels whose centroids are used for the axis, m."""

MAX_POINT_DISTANCE = 200_000.0
"""Distance from most points beyond which a point does not belong to the scan, m."""

TRUSTED_SHARE = 0.8
"""Minimum share of whole sections for an axis that is not doubtful."""

TRUSTED_DISTANCE = 0.5
"""Distance from the line (m) that 95 % of the sections' centres must be within for an axis that is not doubtful."""

TRUSTED_ASIDE = 0.03
"""Share of roofed area off the line from which it is reported."""


def search_axis(
    files: Sequence[Path],
    srid: int | None,
    begin: StartProgress,
    along: Float | None = None,
    given: GivenUnits = NOT_GIVEN,
) -> FoundAxis:
    """Find the axis of the tunnel in scan files.

    Parameters
    ----------
    files
        Scan files of one tunnel.
    srid
        EPSG code that their coordinate systems must have; None: they must agree with each other.
    begin
        Called with a text and the number of points; returns a function that takes the points done.
    along : (k, 2) float array or None
        A line drawn in plan, which the axis follows, m.
    given
        Units of the files' coordinates as given by the user.

    Raises
    ------
    UserError
        If a file can't be read or is in another coordinate system, or no tunnel is found.
    """
    headers = [in_units(read_header(path), given) for path in files]
    for header in headers:
        if srid is not None:
            check_header(header, None, srid, needs_time=False)
    _require_one_system(headers)
    points, sample = _voxels(headers, begin)
    try:
        found = find_axis(points) if along is None else follow_line(points, along)
    except UserError as error:
        raise UserError(f"{_names(files)}: {error}") from None
    form = tunnel_form(sample)  # the size that `inspect` states
    return found if form is None else replace(found, width=form.width, height=form.height)


def found_given(
    files: Sequence[Path],
    srid: int | None,
    begin: StartProgress,
    start: float | None,
    reverse: bool,
    given: GivenUnits = NOT_GIVEN,
) -> tuple[GivenAxis, FoundAxis]:
    """Return the axis found in scan files, in the form of a given axis.

    Parameters
    ----------
    files, srid, begin, given
        As for `search_axis`.
    start
        Chainage of its beginning, m; None: 0.
    reverse
        True if chainage increases from its end farther east.
    """
    if not files:
        raise UserError("--axis auto finds the axis in scan files; name them after the tunnel: --axis auto SCAN...")
    found = search_axis(files, srid, begin, given=given)
    found = found.reversed() if reverse else found
    return GivenAxis(found.xyz, start or 0.0, source=f"the axis found in {_names(files)}"), found


def complete(
    given: GivenAxis, files: Sequence[Path], srid: int, begin: StartProgress, units: GivenUnits = NOT_GIVEN
) -> tuple[GivenAxis, FoundAxis]:
    """Set the middle and heights of a line drawn in plan from scan files; ends and direction stay."""
    found = search_axis(files, srid, begin, given.xyz[:, :2], units)
    note = f"its middle and heights are from {_names(files)}"
    return GivenAxis(found.xyz, given.start, None, given.source, (*given.notes, note)), found


def describe_found(found: FoundAxis, start: float = 0.0) -> list[str]:
    """Return lines on the axis found and its reliability; chainages from ``start`` (m) on."""
    whole, count = int(found.whole.sum()), len(found.whole)
    middle, far = np.nanquantile(found.away, (0.5, 0.95))
    lines = [
        f"axis found: {found.length:.1f} m; the tunnel is {found.width:.1f} m wide and {found.height:.1f} m high",
        f"{whole} of {count} sections have both walls, vault and floor; the middles of half of them are within {middle:.2f} m "
        f"of the line, of 95 % within {far:.2f} m",
    ]
    stretches = [f"{chainage_label(start + a, 0)} to {chainage_label(start + b, 0)}" for a, b in found.doubtful]
    if stretches:
        lines.append(f"check {', '.join(stretches)}: walls, vault or floor are missing there, or are elsewhere")
    if found.off_line_share > TRUSTED_ASIDE and found.off_line_centre is not None:
        lines.append(
            f"{100 * found.off_line_share:.0f} % of the roofed area is not along the line, most of it around "
            f"{found.off_line_centre[0]:.0f},{found.off_line_centre[1]:.0f}: a side room, or the tunnel beyond a "
            "gap or where one side is open"
        )
    if whole < TRUSTED_SHARE * count or far > TRUSTED_DISTANCE:
        lines.append("doubtful as a whole: check the picture before you continue, or draw the line")
    return lines


def write_axis(path: Path, xyz: Float) -> None:
    """Write vertices as a CSV file that ``--axis`` takes."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(("x", "y", "z"))
        table.writerows([f"{value:.3f}" for value in vertex] for vertex in xyz.tolist())


def _voxels(headers: Sequence[ScanHeader], begin: StartProgress) -> tuple[Float, Float]:
    """Return centroids of the voxels on surfaces, and a uniform sample of the points."""
    done = begin("reading", float(sum(header.points for header in headers)))
    voxels, sample, read = Voxels(EDGE), UniformSample(), 0
    middle: Float | None = None
    for header in headers:
        for raw in read_raw(header.path, None, units=header.units):
            sample.add(raw, read)
            read += len(raw)
            chunk = Points.of(raw).located()
            if middle is None and len(chunk.xyz):
                middle = np.median(chunk.xyz, axis=0)
            if middle is not None:
                voxels.add(chunk.xyz[(np.abs(chunk.xyz - middle) < MAX_POINT_DISTANCE).all(axis=1)])
            done(len(raw))
    return without_haze(voxels.centroids(), voxels.counts()), sample.xyz


def _require_one_system(headers: Sequence[ScanHeader]) -> None:
    known = [(header, header.crs) for header in headers if header.crs is not None]
    for header, crs in known:
        require_metres(header)
        unit = plan_unit(crs)
        if unit is not None and unit.metres is None:
            raise UserError(f"{header.path}: its coordinates are in {unit.name}, not metres; transform it")
        first: CRS = known[0][1]
        if not same_horizontally(in_metres(crs), in_metres(first)):
            raise UserError(
                f"{header.path} is in {describe_crs(crs)}, {known[0][0].path} in {describe_crs(first)}; give files of one"
            )


def _names(files: Sequence[Path]) -> str:
    return files[0].name if len(files) == 1 else f"{files[0].name} and {len(files) - 1} more"
