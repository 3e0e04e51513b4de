"""Units of length of coordinates, in plan and in height."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "us-ft": 1200.0 / 3937.0, "in": 0.0254}
"""Length of a unit by its name in options, m; ``ft`` is the international foot, ``us-ft`` the US survey foot."""

_NAMES = {"m": "metre", "cm": "centimetre", "mm": "millimetre", "ft": "foot", "us-ft": "US survey foot", "in": "inch"}
_RELATIVE = 1e-9  # the two feet differ by 2e-6


@dataclass(frozen=True)
class Units:
    """Units of the coordinates of a file.

    Attributes
    ----------
    plan, height : str
        Unit of x and y, and of z, by its name in options.
    """

    plan: str = "m"
    height: str = "m"

    @property
    def metric(self) -> bool:
        """True if both are the metre."""
        return self.plan == self.height == "m"

    @property
    def scales(self) -> Float:
        """Metres per unit of x, y and z, (3,)."""
        return np.array([METRES[self.plan], METRES[self.plan], METRES[self.height]])


IN_METRES = Units()
"""Units of files in metres."""


def unit_option(metres: float) -> str | None:
    """Return the name in options of a unit of this length (m); None if there is none."""
    return next((name for name, length in METRES.items() if math.isclose(length, metres, rel_tol=_RELATIVE)), None)


def unit_name(option: str) -> str:
    """Return the full name of a unit, given by its name in options."""
    return _NAMES[option]
