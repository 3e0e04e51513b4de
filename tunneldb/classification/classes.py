"""Classes of points, as LAS codes: ground as defined by the ASPRS, the others in its user-defined range."""

from __future__ import annotations

from enum import IntEnum


class PointClass(IntEnum):
    """Class of a point (ASPRS LAS 1.4: 1 unassigned, 2 ground, 64 to 255 free for the user)."""

    UNASSIGNED = 1  # unknown: outside the tunnel
    GROUND = 2  # floor, ballast, sleepers, roadway, walkway
    LINING = 64
    NICHE = 65  # lining of a niche or another recess, behind the surface of the sections
    APPENDAGE = 66  # fixture in front of the lining: cable, tray, pipe, box, lamp, catenary
    RAIL = 67  # rails, and other bars along the ground
    OBJECT = 68  # object on the ground: people, trolleys, equipment, bollards
    SPHERE = 69  # a target sphere
    NOISE = 70  # isolated points in the air, or behind the lining
