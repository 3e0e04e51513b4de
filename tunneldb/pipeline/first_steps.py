"""What is missing of a scan to be worked on, and what to type next, by what its files hold."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.errors import UserError
from tunneldb.files import common_name
from tunneldb.geometry.crs import outside_area
from tunneldb.pipeline.inspection import FileLook, IntensityLook
from tunneldb.pointcloud.stations import read_stations
from tunneldb.radiometry.intensity_kind import KindGuess
from tunneldb.store.scanner import FARTHEST_SCANNER

FAR_APART = 0.1
"""Profiles farther apart than this leave room for leaks that are worth a report, m."""

_NO_INTENSITY = "--intensity-kind none"
_MOST_FILES = 5  # named one by one
_PREFERRED = ("reflectance", "amplitude", "linear")
_INTENSITY = re.compile("intens|ampl|reflect|refl")
_SAME_PLACE = 0.001  # m


@dataclass(frozen=True)
class FirstSteps:
    """What to do with scan files.

    Attributes
    ----------
    missing : list of str
        What the files do not say, and who has it.
    doubts : list of str
        What may be wrong with them.
    commands : list of str
        What to type; words in capitals stand for what is missing.
    """

    missing: list[str]
    doubts: list[str]
    commands: list[str]


def needs_axis(looks: Sequence[FileLook]) -> bool:
    """Whether no axis lies beside the files, so that it has to be found in them."""
    return _beside(looks, "axis.csv") is None and not any(look.foreign_unit for look in looks)


def first_steps(looks: Sequence[FileLook], axis_fault: str | None = None) -> FirstSteps:
    """Conclude what to do with the files of a survey.

    Parameters
    ----------
    looks : sequence of FileLook
    axis_fault : str or None
        Why no axis can be found in them, where that was tried.
    """
    missing: list[str] = []
    doubts = [f"{look.path.name}: is it a tunnel? {said}" for look in looks if (said := look.other_than_a_tunnel)]
    doubts += [f"{look.path.name}: {look.unit}" for look in looks if look.unit]
    doubts += [
        f"{look.path.name}: {look.misplaced} points have no coordinates, {look.untimed} no time"
        for look in looks
        if look.misplaced or look.untimed
    ]
    doubts += [
        f"{look.path.name}: its profiles lie {look.profile_spacing:.2f} m apart, and what is between them was not seen"
        for look in looks
        if look.profile_spacing is not None and look.profile_spacing > FAR_APART
    ]
    if all(look.only_noise for look in looks):
        doubts.append(
            "nothing to load: all points would be left out as noise, for none has others near enough to be of one surface with"
            " it; single points that were measured in profiles are no scan"
        )
        return FirstSteps(missing, doubts, [])
    if axis_fault is not None:
        doubts.append(f"no axis can be found in the points (--axis auto is refused): {axis_fault}")
    if foreign := [look.path for look in looks if look.foreign_unit]:
        missing.append(
            f"{', '.join(path.name for path in foreign)} in a projected coordinate system in metres: transform first"
        )
        metric = [_quoted(path.with_name(f"TRANSFORMED-{path.name}")) for path in foreign]
        return FirstSteps(missing, doubts, [f"tunneldb inspect {' '.join(metric)}"])
    name, files = common_name([look.path for look in looks]), _files(looks)
    srid = _srid(looks, missing, doubts)
    axis = _beside(looks, "axis.csv")
    if axis is not None:
        given = _quoted(axis)
    elif axis_fault is None:
        given = f"auto {files}"
        missing.append("the given axis, which no scan holds: give --axis your own, or have it found from the points (auto)")
    else:
        given = "AXIS.csv"
        missing.append("the given axis, x,y,z in place of AXIS.csv: it can't be found from these points")
    survey, date = _survey(looks, name, missing)
    unknown: list[str] = []
    lacking: list[str] = []
    poses, intensity = _poses(looks, unknown, doubts), _intensity(looks, lacking, doubts)
    if unknown and intensity == _NO_INTENSITY:  # it alone needs them
        poses, unknown = "--no-poses", []
    missing += unknown + lacking
    if axis_fault is not None and intensity != _NO_INTENSITY:
        stations = poses if poses.startswith("--stations") else "--stations STATIONS.csv"
        levels = intensity.removesuffix(" --reference auto")  # that takes a lining
        doubts.append(
            "what stands without an axis (a hall, a bridge, a plant) is looked at by: tunneldb members"
            f" {_quoted(looks[0].path)} {stations} {levels} -o {shlex.quote(f'{name}-members.gpkg')}"
        )
    tunnel = f"tunneldb tunnel add {name} --srid {srid} --axis {given}"
    return FirstSteps(
        missing,
        doubts,
        [
            "tunneldb init",
            tunnel,
            f"tunneldb survey add {survey} --tunnel {name} --date {date} {poses} {intensity}",
            f"tunneldb load {survey} {files}",
            f"tunneldb run {survey}",
        ],
    )


def _quoted(path: Path) -> str:
    return shlex.quote(str(path))


def _files(looks: Sequence[FileLook]) -> str:
    folders, suffixes = {look.path.parent for look in looks}, {look.path.suffix for look in looks}
    if len(looks) > _MOST_FILES and len(folders) == 1 and len(suffixes) == 1:
        there = {path.name for path in looks[0].path.parent.glob(f"*{looks[0].path.suffix}")}
        if there == {look.path.name for look in looks}:
            folder = looks[0].path.parent
            return f"*{looks[0].path.suffix}" if folder == Path() else f"{_quoted(folder)}/*{looks[0].path.suffix}"
    return " ".join(_quoted(look.path) for look in looks)


def _survey(looks: Sequence[FileLook], name: str, missing: list[str]) -> tuple[str, str]:
    dates = [look.date for look in looks if look.date is not None]
    if not dates:
        missing.append("the day of the scan, in place of YYYY-MM-DD")
        return f"{name}-1" if name.lower().endswith("scan") else f"{name}-scan", "YYYY-MM-DD"
    return f"{name}-{min(dates).year}", min(dates).isoformat()


def _srid(looks: Sequence[FileLook], missing: list[str], doubts: list[str]) -> str:
    named = {look.crs: look.srid for look in looks if look.crs is not None}
    if len(set(named.values())) > 1:
        doubts.append(f"the files are in different coordinate systems: {', '.join(map(str, named))}; transform them to one")
    codes = [code for code in named.values() if code is not None]
    doubts += [f"{look.path.name}: its coordinate system can't be read: {look.unread_crs}" for look in looks if look.unread_crs]
    if codes:
        doubts += [
            f"{look.path.name}: {place}"
            for look in looks
            if (place := outside_area(look.srid, np.array([look.low[:2], look.high[:2]])))
        ]
        return str(codes[0])
    why = f"that of {next(iter(named))} has no EPSG code" if named else "no file states one"
    missing.append(
        f"the coordinate system, as EPSG code in place of SRID: {why}; it must be projected and in metres; or local, if the "
        "coordinates are the site's own, in metres"
    )
    return "SRID"


def _beside(looks: Sequence[FileLook], ending: str) -> Path | None:
    """File beside the scans that is called as one of them, but for its ending; None if there is none, or more than one."""
    found = set()
    for look in looks:
        stem = look.path.name.split(".", 1)[0]
        for path in look.path.parent.glob(f"*.{ending}"):
            if stem == path.name[: -len(ending) - 1] or stem.startswith(f"{path.name[: -len(ending) - 1]}-"):
                found.add(path)
    return found.pop() if len(found) == 1 else None


def _poses(looks: Sequence[FileLook], missing: list[str], doubts: list[str]) -> str:
    posed = [look for look in looks if look.poses]
    if posed and all(scan.position is not None for look in posed for scan in look.poses):
        _doubt_positions(posed, doubts)
        return " ".join(f"--stations {_quoted(look.path)}" for look in posed)
    trajectory, stations = _beside(looks, "trajectory.csv"), _beside(looks, "stations.csv")
    if trajectory is not None:
        return f"--trajectory {_quoted(trajectory)}"
    if stations is not None:
        return f"--stations {_quoted(stations)}"
    other = _stations_in_folder(looks)
    if other is not None:
        doubts.append(
            f"{other.name} has stations of the files' scan_id, near their points, and another name: are they of this scan?"
        )
        return f"--stations {_quoted(other)}"
    scans = sorted({scan for look in looks for scan in look.scans})
    times = [time for look in looks if look.times for time in look.times]
    if times and len(scans) < 3:
        missing.append(
            "where the scanner was: its trajectory as TRAJECTORY.csv with time,x,y,z, time being the gps_time of the files, "
            f"{min(times):.3f} to {max(times):.3f}; of a scanner that stood still its stations, see --stations; "
            "if nobody knows, --no-poses in place of it, with intensity of kind reflectance or none"
        )
        return "--trajectory TRAJECTORY.csv"
    listed = ", ".join(map(str, scans[:10])) + (f" and {len(scans) - 10} more" if len(scans) > 10 else "")
    missing.append(f"where the scanner stood: STATIONS.csv with scan_id,x,y,z, of scan_id {listed}")
    if len(scans) == 1:
        doubts.append(
            "if this is several scans, merged, their positions are lost: export them one by one; or say --no-poses in place of "
            "--stations, with intensity of kind reflectance or none"
        )
    return "--stations STATIONS.csv"


def _stations_in_folder(looks: Sequence[FileLook]) -> Path | None:
    """The one table in the files' folders that is called stations and has one, near the points, for each scan; else None."""
    scans = {scan for look in looks for scan in look.scans}
    low = np.min([look.low for look in looks], axis=0) - FARTHEST_SCANNER
    high = np.max([look.high for look in looks], axis=0) + FARTHEST_SCANNER
    found = []
    for path in sorted({path for look in looks for path in look.path.parent.glob("*stations*.csv")}):
        try:
            stations = read_stations([path])
        except UserError:  # another table
            continue
        own = np.isin(stations.scan_id, sorted(scans))
        near = np.all((stations.xyz >= low) & (stations.xyz <= high), axis=1)
        if scans <= set(stations.scan_id.tolist()) and near[own].all():
            found.append(path)
    return found[0] if len(found) == 1 else None


def _doubt_positions(posed: Sequence[FileLook], doubts: list[str]) -> None:
    places = np.array([scan.position for look in posed for scan in look.poses])
    if np.any(np.abs(places).max(axis=1) < _SAME_PLACE):
        doubts.append(
            "the pose of a scan is 0, 0, 0: did the scanner stand there, or was the pose lost when the scan was exported?"
        )
    elif len(places) > 1 and float(np.ptp(places, axis=0).max()) < _SAME_PLACE:
        doubts.append(f"all {len(places)} scans have the same position: export them with their own poses")


def _intensity(looks: Sequence[FileLook], missing: list[str], doubts: list[str]) -> str:
    found = _common_intensity(looks)
    if found is None:
        missing.append("an intensity that leaks can be found in; without one the lining is shown, and no leaks are sought")
        return _NO_INTENSITY
    name, guess, sure = found
    if not sure:
        doubts.append(f"{name} is taken for {guess.what} by its values ({guess.reason}): ask who scanned it, and say so")
    words = f"--intensity {shlex.quote(name)} --intensity-kind {guess.kind}"
    if guess.kind == "reflectance":
        return words
    reference = _beside(looks, "reference.csv")
    return f"{words} --reference {'auto' if reference is None else _quoted(reference)}"


def _common_intensity(looks: Sequence[FileLook]) -> tuple[str, KindGuess, bool] | None:
    """Dimension that all files have and whose values may be an intensity, what it may be, and whether its name says so too."""
    found = []
    for first in looks[0].intensities:
        same = [_named(look, first.name) for look in looks]
        kinds = [[guess.kind for guess in one.usable] if one is not None else [] for one in same]
        guesses = [guess for guess in first.usable if all(guess.kind in kind for kind in kinds)]
        if guesses and _INTENSITY.search(first.name.lower()):
            found.append((first.name, guesses[0], guesses[0].kind in first.name.lower()))
    return min(found, key=lambda one: _PREFERRED.index(one[1].kind), default=None)


def _named(look: FileLook, name: str) -> IntensityLook | None:
    return next((one for one in look.intensities if one.name == name), None)
