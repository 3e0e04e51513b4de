"""Unit of length of a tunnel's points, by the size of its cross-section and the distance of its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float
from tunneldb.geometry.units import METRES, unit_name
from tunneldb.pointcloud.form import TunnelForm, tunnel_form

MAX_WIDTH = 20.0
"""Width from which a tunnel is probably in another unit, m: three lanes with their shoulders have 16 to 18 m."""

MIN_WIDTH = 1.5
"""Least width for carrying a scanner through, m."""

MIN_HEIGHT_RATIO = 0.3
"""Height over width below which a cloud is open country and not a tunnel."""

MIN_SPACING = 0.0005
"""Least typical distance of neighbouring points of a scan, m."""

_OTHERS = ("ft", "in", "cm", "mm")
_SAMPLE = 50_000  # points on which sizes are found
_NEAREST = 2000  # points whose neighbours are searched
_PLURALS = {"foot": "feet", "inch": "inches"}


@dataclass(frozen=True)
class UnitGuess:
    """Unit that is probably not the metre.

    Attributes
    ----------
    text : str
        The possible units, the reason, and what to type.
    option : str
        Option that converts the file; UNIT in place of several.
    """

    text: str
    option: str


def guess_unit(xyz: Float, share: float, form: TunnelForm | None) -> UnitGuess | None:
    """Return the probable unit of points (n, 3) that state none; None if it can be the metre, or no unit makes them a tunnel.

    Parameters
    ----------
    xyz : (n, 3) float array
        Random sample of the points, in their unit.
    share : float
        Share of all points that is in the sample.
    form : TunnelForm or None
        Form of the points if they are in metres.
    """
    if form is not None and (form.width <= MAX_WIDTH or form.height < MIN_HEIGHT_RATIO * form.width):
        return None
    if float(np.ptp(xyz[:, :2], axis=0).max(initial=0.0)) <= MAX_WIDTH:
        return None
    spacing = typical_spacing(xyz) * np.sqrt(share)
    xyz = np.random.default_rng(1).permutation(xyz)[:_SAMPLE]
    found = {unit: size for unit in _OTHERS if (size := _size(xyz, spacing, METRES[unit])) is not None}
    if not found:
        return None
    names = {unit: _PLURALS.get(unit_name(unit), f"{unit_name(unit)}s") for unit in found}
    sizes = [
        f"in {names[unit]} the tunnel is {width:.1f} m wide and {height:.1f} m high" for unit, (width, height) in found.items()
    ]
    options = " or ".join(f"--unit {unit}" for unit in found)
    return UnitGuess(
        f"looks like {' or '.join(names.values())}: {', '.join(sizes)}, and neighbouring points are {spacing:.3g} units apart;"
        f" no unit is stated: give {options}, or --unit m if these are metres",
        " --unit " + (next(iter(found)) if len(found) == 1 else "UNIT"),
    )


def _size(xyz: Float, spacing: float, metres: float) -> tuple[float, float] | None:
    """Return width and height in a unit, m; None if these are not a tunnel's."""
    if spacing * metres < MIN_SPACING:
        return None
    form = tunnel_form(xyz * metres)
    if form is None or not MIN_WIDTH <= form.width <= MAX_WIDTH or form.height < MIN_HEIGHT_RATIO * form.width:
        return None
    return form.width, form.height


def typical_spacing(xyz: Float) -> float:
    """Return the typical distance of neighbouring points of a sample (n, 3), in its unit."""
    some = np.unique(np.linspace(0, len(xyz) - 1, _NEAREST).astype(int))
    near = cKDTree(xyz).query(xyz[some], k=2)[0][:, 1]
    near = near[np.isfinite(near) & (near > 0.0)]
    return float(np.median(near)) if len(near) else 0.0
