"""Doubts about the stations of a static scanner, from a sample of the points measured from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.pointcloud.merged_scans import MergedScan, find_merged
from tunneldb.pointcloud.pose_faults_text import merged_fault, stations_fault
from tunneldb.pointcloud.station_fit import Misfit, find_misfits
from tunneldb.pointcloud.trajectory_fit import outside_section

MAX_MISFIT_SHARE = 0.1
"""Share of the points of scans with wrong stations from which results would be wrong."""

_NEAR = 10.0  # m along the tunnel within which the points of a station show the section about it


def doubt_stations(place: Float, scan_id: Int64, scans: Int64, stations: Float) -> tuple[str, bool] | None:
    """Return why points were not measured from their stations, and whether results would be wrong; None if they can be.

    Parameters
    ----------
    place, scan_id : (n, 3) float and (n,) int arrays
        Sample of points: distance along the tunnel's line, to the right, and height, m; numbers of their scans.
    scans, stations : (k,) int and (k, 3) float arrays
        Numbers of scans, ascending, and their stations, as the points.
    """
    if not len(scans) or not len(place):
        return None
    at = np.minimum(np.searchsorted(scans, scan_id), len(scans) - 1)
    scanner = np.where((scans[at] == scan_id)[:, None], stations[at], np.nan)
    scanner[~(np.abs(scanner[:, 0] - place[:, 0]) < _NEAR)] = np.nan
    outside = outside_section(place, scanner)
    if outside > 0.0:
        return (
            f"the stations lie {outside:.0f} m outside the tunnel's section, which its points show: they are of another"
            " tunnel, or in another system",
            True,
        )
    merged = find_merged(place[:, 0], scan_id)
    if merged:
        return merged_fault(merged), _many(merged)
    misfits = find_misfits(place, scan_id, scans, stations)
    return (stations_fault(misfits), _many(misfits)) if misfits else None


def _many(faults: Sequence[Misfit] | Sequence[MergedScan]) -> bool:
    return sum(one.share for one in faults) > MAX_MISFIT_SHARE
