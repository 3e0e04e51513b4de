"""Field work: a scan from stations, or from something that moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .canvas import Canvas
from .casting import Tunnel
from .fittings import Fitting
from .instrument import Instrument, Matt
from .scanner import drive, joined, scan, station, thinned
from .section import Alignment
from .survey import Survey


def static_survey(
    canvas: Canvas,
    alignment: Alignment,
    fittings: Sequence[Fitting],
    instrument: Instrument,
    matt: Matt,
    stands: list[tuple[float, float, float]],
    axis: tuple[float, float],
    resolution: float = 0.0035,
    spacing: float = 0.018,
    steps: int = 2,
    reference: tuple[float, float] | tuple[()] = (),
    most: int = 2_900_000,
) -> Survey:
    """Scan from tripods.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    alignment : Alignment
        Where the tunnel lies.
    fittings : sequence of Fitting
        What is before the lining.
    instrument : Instrument
        The scanner.
    matt : Matt
        How surfaces scatter.
    stands : list of tuple of float
        Chainage, offset and height of the scanner at each station.
    axis : tuple of float
        Offset and height of the axis handed over.
    resolution : float
        Angle between beams, in radians.
    spacing : float
        To which the surveyor has thinned the joint cloud, in metres.
    steps : int
        Steps in which a ray searches the unevenness of the lining.
    reference : tuple of float
        Ranges of the reference curve; empty where there is none.
    most : int
        Greatest number of points.

    Returns
    -------
    Survey
    """
    rng = canvas.rng
    clouds = []
    for number, (u, y, z) in enumerate(stands, 1):
        tunnel = Tunnel(canvas, fittings, y, z, steps)
        rays = station(number, u, resolution, 212_400.0 + 420 * number, rng)
        clouds.append(scan(tunnel, alignment, rays, instrument, matt, rng))
    cloud = thinned(joined(clouds), spacing, most, rng)
    return Survey(canvas, alignment, instrument, cloud, axis, stands, np.empty((0, 4)), reference)


def mobile_survey(
    canvas: Canvas,
    alignment: Alignment,
    fittings: Sequence[Fitting],
    instrument: Instrument,
    matt: Matt,
    mount: tuple[float, float],
    axis: tuple[float, float],
    spacing: float = 0.02,
    resolution: float = 0.0045,
    speed: float = 0.8,
    tilt: float = 0.0,
    steps: int = 2,
    reference: tuple[float, float] = (0.5, 12.0),
) -> Survey:
    """Scan with a profile scanner on a trolley or a vehicle.

    Parameters
    ----------
    canvas, alignment, fittings, instrument, matt, axis, steps, reference
        As for `static_survey`.
    mount : tuple of float
        Offset and height of the scanner.
    spacing : float
        Between turns, in metres.
    resolution : float
        Angle between beams, in radians.
    speed : float
        In metres per second.
    tilt : float
        Of the plane of the beams out of the section, in radians.

    Returns
    -------
    Survey
    """
    rng = canvas.rng
    tunnel = Tunnel(canvas, fittings, *mount, steps)
    begun = 387_215.4
    before = 12 * abs(np.tan(tilt)) + 0.5
    rays = drive(-before, canvas.length + before, spacing, resolution, speed, begun, tilt)
    cloud = scan(tunnel, alignment, rays, instrument, matt, rng)
    cloud = cloud.take(np.argsort(cloud.time))
    times = np.arange(begun - 1, begun + (canvas.length + 2 * before) / speed + 1, 0.1)
    way = np.column_stack(
        [times, (times - begun) * speed - before, np.full(len(times), mount[0]), np.full(len(times), mount[1])]
    )
    return Survey(canvas, alignment, instrument, cloud, axis, [], way, reference)
