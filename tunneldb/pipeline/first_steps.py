"""Missing input of a scan, and the commands to type next, from the contents of its files."""

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
from tunneldb.pipeline.inspected_poses import file_beside
from tunneldb.pipeline.inspection import FileLook, IntensityLook
from tunneldb.pointcloud.stations import read_stations
from tunneldb.radiometry.intensity_kind import KindGuess
from tunneldb.store.scanner import FARTHEST_SCANNER

FAR_APART = 0.1
"""Profile spacing from which missed leaks are worth a remark, m."""

FEW_POINTS = 200.0
"""Density below which most leaks of 0.3 m² and 3 dB are missed, points/m²: two of five are found at 150 on smooth lining
(docs/figures.md)."""

_NO_INTENSITY = "--intensity-kind none"
_MAX_FILES = 5  # named one by one
_PREFERRED = ("reflectance", "amplitude", "linear")
_INTENSITY = re.compile("intens|ampl|reflect|refl")
_SAME_PLACE = 0.001  # m


@dataclass(frozen=True)
class FirstSteps:
    """Commands for scan files.

    Attributes
    ----------
    missing : list of str
        Missing information, and its sources.
    doubts : list of str
        Possible errors.
    commands : list of str
        Commands; words in capitals are placeholders of missing information.
    """

    missing: list[str]
    doubts: list[str]
    commands: list[str]


def needs_axis(looks: Sequence[FileLook]) -> bool:
    """Return True if no axis file is beside the scans, so that it must be found in them, and they are in metres."""
    foreign = any(look.foreign_unit for look in looks)
    return _beside(looks, "axis.csv") is None and not foreign and not all(look.only_noise for look in looks)


def first_steps(looks: Sequence[FileLook], axis_fault: str | None = None) -> FirstSteps:
    """Choose the commands for the files of a survey.

    Parameters
    ----------
    looks : sequence of FileLook
    axis_fault : str or None
        Why no axis can be found in them, where that was tried.
    """
    missing: list[str] = []
    doubts = [f"{look.path.name}: is it a tunnel? {said}" for look in looks if (said := look.other_than_a_tunnel)]
    doubts += [f"{look.path.name}: {look.unit}" for look in looks if look.unit]
    doubts += [f"{look.path.name}: {look.header_note}" for look in looks if look.header_note]
    doubts += [f"{look.path.name}: {note}" for look in looks for note in look.notes]
    doubts += [
        f"{look.path.name}: points without coordinates: {look.misplaced}; without time: {look.untimed}"
        for look in looks
        if look.misplaced or look.untimed
    ]
    doubts += [f"{look.path.name}: {look.pose_doubt}" for look in looks if look.pose_doubt]
    doubts += [f"{look.path.name}: {look.axis_doubt}" for look in looks if look.axis_doubt]
    doubts += [
        f"{look.path.name}: its profiles are {look.profile_spacing:.2f} m apart; the lining between them was not measured"
        for look in looks
        if look.profile_spacing is not None and look.profile_spacing > FAR_APART
    ]
    doubts += [
        f"{look.path.name}: it has {look.density[1]:.3g} points per m²; with less than {FEW_POINTS:.0f}, most leaks of 0.3 m²"
        " and 3 dB are not found, and tunneldb run states which could be"
        for look in looks
        if look.density[1] < FEW_POINTS and look.intensities and not look.foreign_unit
    ]
    if foreign := [look for look in looks if look.foreign_unit]:
        return FirstSteps(missing, doubts, [_in_metres(foreign, missing)])
    if all(look.only_noise for look in looks):
        doubts.append(
            "nothing to load: all points would be left out as noise, because none has others near enough on one surface;"
            " single points measured in profiles are not a scan"
        )
        return FirstSteps(missing, doubts, [])
    if axis_fault is not None:
        doubts.append(f"no axis can be found in the points (--axis auto is refused): {axis_fault}")
    name, files = common_name([look.path for look in looks]), _files(looks)
    units = looks[0].unit_options
    srid = _srid(looks, missing, doubts)
    axis = _beside(looks, "axis.csv")
    if axis is not None:
        given = _quoted(axis)
    elif axis_fault is None:
        given = f"auto {files}{units}"
        missing.append("the given axis, which no scan contains: give your own with --axis, or have it found (auto)")
    else:
        given = "AXIS.csv"
        missing.append("the given axis, x,y,z in place of AXIS.csv: it cannot be found from these points")
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
            "structures without an axis (a hall, a bridge, a plant): tunneldb members"
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
            f"tunneldb load {survey} {files}{units}",
            f"tunneldb run {survey}",
        ],
    )


def _in_metres(foreign: Sequence[FileLook], missing: list[str]) -> str:
    """Return the command for files that are not in metres: with their units, or after a transformation."""
    names = ", ".join(look.path.name for look in foreign)
    options = {look.suggested_units for look in foreign}
    if len(options) == 1 and (units := options.pop()):
        if "UNIT" in units.split():
            missing.append(f"the unit of {names}, in place of UNIT, see above")
        return f"tunneldb inspect {' '.join(_quoted(look.path) for look in foreign)}{units}"
    missing.append(f"{names} in a projected coordinate system in metres: transform first")
    metric = [_quoted(look.path.with_name(f"TRANSFORMED-{look.path.name}")) for look in foreign]
    return f"tunneldb inspect {' '.join(metric)}"


def _quoted(path: Path) -> str:
    return shlex.quote(str(path))


def _files(looks: Sequence[FileLook]) -> str:
    folders, suffixes = {look.path.parent for look in looks}, {look.path.suffix for look in looks}
    if len(looks) > _MAX_FILES and len(folders) == 1 and len(suffixes) == 1:
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
    doubts += [
        f"{look.path.name}: its coordinate system cannot be read: {look.unread_crs}" for look in looks if look.unread_crs
    ]
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
    """Return the file beside the scans with the same name but another extension; None if there is none, or several."""
    return file_beside([look.path for look in looks], ending)


def _poses(looks: Sequence[FileLook], missing: list[str], doubts: list[str]) -> str:
    posed = [look for look in looks if look.poses]
    lost = [look for look in looks if look.lost_positions]
    doubts += [f"{look.path.name}: {look.lost_positions}" for look in lost]
    if posed and not lost and all(scan.position is not None for look in posed for scan in look.poses):
        _doubt_positions(posed, doubts)
        return " ".join(f"--stations {_quoted(look.path)}" for look in posed) + looks[0].unit_options
    trajectory, stations = (
        _beside(looks, "trajectory.csv"),
        _beside(looks, "stations.csv"),
    )
    if trajectory is not None:
        offsets = {look.time_offset for look in looks}
        offset = offsets.pop() if len(offsets) == 1 else None
        return f"--trajectory {_quoted(trajectory)}" + ("" if offset is None else f" --time-offset {offset:.12g}")
    if stations is not None:
        return f"--stations {_quoted(stations)}"
    other = _stations_in_folder(looks)
    if other is not None:
        doubts.append(f"{other.name} has stations of the files' scan_id, near their points, but another name: check this guess")
        return f"--stations {_quoted(other)}"
    scans = sorted({scan for look in looks for scan in look.scans})
    times = [time for look in looks if look.times for time in look.times]
    if times and len(scans) < 3:
        missing.append(
            "scanner positions: the trajectory as TRAJECTORY.csv with time,x,y,z, time being the gps_time of the files, "
            f"{min(times):.3f} to {max(times):.3f}; for a static scanner its stations, see --stations; "
            "if unknown, --no-poses in place of it, with intensity of kind reflectance or none"
        )
        return "--trajectory TRAJECTORY.csv"
    listed = ", ".join(map(str, scans[:10])) + (f" and {len(scans) - 10} more" if len(scans) > 10 else "")
    missing.append(f"scanner positions: STATIONS.csv with scan_id,x,y,z, of scan_id {listed}")
    if len(scans) == 1:
        doubts.append(
            "if several scans were merged into this file, their positions are lost: export each scan as a file; or use "
            "--no-poses in place of "
            "--stations, with intensity of kind reflectance or none"
        )
    return "--stations STATIONS.csv"


def _stations_in_folder(looks: Sequence[FileLook]) -> Path | None:
    """Return the only table named stations in the files' folders with one, near the points, for each scan; else None."""
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
        doubts.append("the pose of a scan is 0, 0, 0: check whether the scanner stood there, or the pose was lost on export")
    elif len(places) > 1 and float(np.ptp(places, axis=0).max()) < _SAME_PLACE:
        doubts.append(f"all {len(places)} scans have the same position: export them with their own poses")


def _intensity(looks: Sequence[FileLook], missing: list[str], doubts: list[str]) -> str:
    found = _common_intensity(looks)
    if found is None:
        missing.append("an intensity for finding leaks; without one the lining is shown, and leaks are not searched for")
        return _NO_INTENSITY
    name, guess, sure = found
    if not sure:
        doubts.append(f"{name} is guessed to be {guess.what} from its values ({guess.reason}): ask who scanned it")
    words = f"--intensity {shlex.quote(name)} --intensity-kind {guess.kind}"
    if guess.kind == "reflectance":
        return words
    reference = _beside(looks, "reference.csv")
    return f"{words} --reference {'auto' if reference is None else _quoted(reference)}"


def _common_intensity(looks: Sequence[FileLook]) -> tuple[str, KindGuess, bool] | None:
    """Return a dimension of all files that may be an intensity, its kind, and whether its name says so too."""
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
