"""Messages about scanner positions that do not fit the points."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from tunneldb.pointcloud.merged_scans import MergedScan
from tunneldb.pointcloud.station_fit import Misfit
from tunneldb.pointcloud.trajectory_fit import WRONG, TrajectoryFit

_NAMED = 5  # scans


def trajectory_fault(fit: TrajectoryFit, added: float, option: str) -> str:
    """Return the message about a trajectory that does not fit the points.

    Parameters
    ----------
    fit : TrajectoryFit
        Comparison.
    added : float
        Seconds that are already added to the trajectory's times.
    option : str
        Command up to the value of ``--time-offset``.
    """
    if fit.outside > 0.0:
        return (
            f"the scanner's positions lie {fit.outside:.0f} m outside the section that the points show: the trajectory is of"
            " another tunnel, or in another coordinate system; give the trajectory of this scan"
        )
    found = []
    if (fit.distance > WRONG / 2.0 and fit.wrong >= 0.5 * fit.known) or fit.wrong <= 0.0 < fit.distance:
        found.append(
            f"half of its profiles lie {fit.distance:.1f} m or more along the axis from the scanner's position at their time"
            f" (the farthest {fit.greatest:.0f} m)"
        )
    elif fit.wrong > 0.0:
        found.append(
            f"{100.0 * fit.wrong:.0f} % of its profiles lie {WRONG:g} m or more along the axis from the scanner's position at"
            f" their time (the farthest {fit.greatest:.0f} m)"
        )
    if fit.known < 0.99:
        found.append(f"{100.0 * (1.0 - fit.known):.0f} % of its points were measured at times without a pose")
    return f"{' and '.join(found)}: {_cause(fit, added, option)}"


def _cause(fit: TrajectoryFit, added: float, option: str) -> str:
    if fit.scale:
        return f"the trajectory's times seem to be in {fit.scale}"
    shift = f"a shift of {abs(fit.shift):.1f} m along the tunnel between positions and points" if fit.shift else ""
    if fit.offset is None and shift:
        return f"the cause is {shift}; give the trajectory of this scan, in its coordinate system"
    if fit.offset is None:
        return "no time offset makes them fit; the trajectory is of another scan, or its clock changed during the scan"
    cause = fit.cause or fit.clocks or "it is no usual difference of clocks" + (f", and may be {shift}" if shift else "")
    return (
        f"{cause}; with {fit.offset:+.12g} s on the trajectory's times they fit to {max(fit.remaining, 0.1):.1f} m:"
        f" {option} {added + fit.offset:.12g}"
    )


def stations_fault(misfits: Sequence[Misfit]) -> str:
    """Return the message about stations that do not fit the points of their scans."""
    named = [
        f"scan {one.scan_id}: {abs(one.shift):.0f} m {'after' if one.shift > 0.0 else 'before'} its station"
        + (f", at that of scan {one.station}" if one.station is not None else "")
        for one in misfits[:_NAMED]
    ]
    more = f"; and {len(misfits) - _NAMED} more" if len(misfits) > _NAMED else ""
    return (
        "scans were measured from other places along the axis than their stations (the directions to the points show it): "
        f"{'; '.join(named)}{more}"
    )


def merged_fault(merged: Sequence[MergedScan]) -> str:
    """Return the message about scans that were merged under one number."""
    named = [
        f"scan {one.scan_id}: {len(one.places)} places, "
        f"{' and '.join(f'{after - before:.0f} m' for before, after in pairwise(one.places))} apart"
        for one in merged[:_NAMED]
    ]
    more = f"; and {len(merged) - _NAMED} more" if len(merged) > _NAMED else ""
    return (
        "points of one scan number were measured from several places (their numbers along the tunnel show it):"
        f" {'; '.join(named)}{more}; scans were merged: export them with one number and one station each"
    )
