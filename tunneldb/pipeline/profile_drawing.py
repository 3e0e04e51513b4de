"""The outline of a DXF drawing: LINE, ARC, CIRCLE and polylines with bulges, joined end to end."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tunneldb.alignment.dxf import open_drawing, unit_name
from tunneldb.arrays import Float
from tunneldb.errors import InputError

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}
"""Length of a unit, m."""

MAX_JOINED_GAP = 0.001
"""Maximum gap between ends that are joined, m."""

_MAX_ELEMENTS = 5000  # of a profile: 30 m in pieces of 6 mm
_PLAIN = ("LINE", "ARC", "CIRCLE")
_POLYLINES = ("LWPOLYLINE", "POLYLINE")
_CURVES = ("SPLINE", "ELLIPSE")


@dataclass(frozen=True)
class DrawnOutline:
    """An outline as it is drawn.

    Attributes
    ----------
    elements : (m, 5) float array
        Begin, end, m, and bulge, each beginning where the one before ends.
    names : list of str
        Kind and handle of the entity that each is from.
    metres : float
        In a unit of the drawing.
    notes : tuple of str
    """

    elements: Float
    names: list[str]
    metres: float
    notes: tuple[str, ...]


def read_drawing(path: Path, unit: str | None, layer: str | None) -> DrawnOutline:
    """Read the outline in the model space of a drawing.

    Raises
    ------
    InputError
        If it can't be read, states no unit and none is given, or another; has several layers of lines and none is chosen; has
        curves that are no arcs; or leaves a gap.
    """
    drawing, repaired = open_drawing(path)
    metres = _unit(path, drawing.header.get("$INSUNITS", 0), unit)
    entities: list[Any] = [one for one in drawing.modelspace() if one.dxftype() in (*_PLAIN, *_POLYLINES, *_CURVES)]
    chosen = _layer(path, sorted({one.dxf.layer for one in entities}), layer)
    elements, names = [], []
    for entity in entities:
        if entity.dxf.layer != chosen:
            continue
        name = f"{entity.dxftype()} {entity.dxf.handle}"
        if entity.dxftype() in _CURVES:
            raise InputError(f"{path}, {name}: a profile consists of lines and arcs; {entity.dxftype()} is not supported")
        parts = entity.virtual_entities() if entity.dxftype() in _POLYLINES else [entity]
        for part in parts:
            for element in _elements(part):
                if np.hypot(element[2] - element[0], element[3] - element[1]) * metres > 1e-6:
                    elements.append(element)
                    names.append(name)
        if len(elements) > _MAX_ELEMENTS:
            raise InputError(
                f"{path}: layer {chosen!r} has more than {_MAX_ELEMENTS} lines and arcs; draw the profile alone on a layer"
            )
    if not elements:
        raise InputError(f"{path}: layer {chosen!r} has no line with a length")
    scaled = np.array(elements)
    scaled[:, :4] *= metres
    return DrawnOutline(*_joined(path, scaled, names), metres, (repaired,) if repaired else ())


def _unit(path: Path, code: int, unit: str | None) -> float:
    """Return the unit of the drawing in metres; it is never guessed."""
    from ezdxf import units

    stated = {units.M: "m", units.CM: "cm", units.MM: "mm", units.FT: "ft", units.IN: "in"}.get(code)
    if unit is None:
        if stated is None:
            says = f"its unit is {unit_name(code)}" if code else "it states no unit"
            raise InputError(f"{path}: {says} ($INSUNITS {code}); say what its lengths are by --unit {'|'.join(METRES)}")
        return METRES[stated]
    if stated is not None and stated != unit:
        raise InputError(
            f"{path}: it states {stated} ($INSUNITS {code}), --unit says {unit}; omit --unit, or set the drawing's unit"
        )
    return METRES[unit]


def _layer(path: Path, names: list[str], wanted: str | None) -> str:
    listed = ", ".join(map(repr, names)) or "none"
    if wanted is not None and wanted not in names:
        raise InputError(f"{path} has no layer {wanted!r} of lines; it has {listed}")
    if wanted is None and len(names) != 1:
        remedy = "; choose one by --drawing-layer NAME" if names else ""
        raise InputError(f"{path} has {len(names)} layers of lines: {listed}{remedy}")
    return wanted or names[0]


def _elements(entity: Any) -> list[list[float]]:
    """Begin, end and bulge of a LINE, of an ARC, or of both halves of a CIRCLE, in the drawing's unit."""
    if entity.dxftype() == "LINE":
        begin, end = entity.dxf.start, entity.dxf.end
        return [[begin.x, begin.y, end.x, end.y, 0.0]]
    side = -1.0 if entity.dxf.extrusion.z < 0.0 else 1.0  # drawn from behind, an arc turns the other way
    if entity.dxftype() == "CIRCLE":
        first, second = entity.vertices([0.0, 180.0])
        return [[first.x, first.y, second.x, second.y, side], [second.x, second.y, first.x, first.y, side]]
    begin, end = entity.start_point, entity.end_point
    turn = (entity.dxf.end_angle - entity.dxf.start_angle) % 360.0
    return [[begin.x, begin.y, end.x, end.y, side * np.tan(np.radians(turn) / 4.0)]]


def _joined(path: Path, elements: Float, names: list[str]) -> tuple[Float, list[str]]:
    """Connect elements one after the other, reversed if drawn in the other direction."""
    chain, order = [elements[0]], [0]
    ends, free = elements[:, :4].reshape(-1, 2, 2), np.arange(len(elements)) > 0

    def nearest(x: float, y: float) -> tuple[float, int, bool]:
        """Return the distance of the nearest free end, its element, and whether it is an end and not a beginning."""
        away = np.where(free[:, None], np.hypot(ends[:, :, 0] - x, ends[:, :, 1] - y), np.inf)
        k, end = divmod(int(np.argmin(away)), 2)
        return float(away[k, end]), k, end == 1

    while free.any():
        ahead, behind = nearest(*chain[-1][2:4]), nearest(*chain[0][:2])
        away, k, at_end = min(ahead, behind)
        if not away <= MAX_JOINED_GAP:
            x, y = chain[-1][2:4] if away == ahead[0] else chain[0][:2]
            beside = order[-1] if away == ahead[0] else order[0]
            raise InputError(
                f"{path}, {names[beside]}: a gap of {1e3 * away:.1f} mm between its end at {x:.4f},{y:.4f} m and the nearest "
                f"other, of {names[k]}"
            )
        forwards = (away, k, at_end) == ahead
        element = elements[k] if at_end is not forwards else _turned(elements[k])
        element = element.copy()
        if forwards:
            element[:2] = chain[-1][2:4]
            chain.append(element)
            order.append(k)
        else:
            element[2:4] = chain[0][:2]
            chain.insert(0, element)
            order.insert(0, k)
        free[k] = False
    if len(chain) > 1 and np.hypot(*(chain[-1][2:4] - chain[0][:2])) <= MAX_JOINED_GAP:
        chain[-1][2:4] = chain[0][:2]
    return np.array(chain), [names[k] for k in order]


def _turned(element: Float) -> Float:
    return np.array([*element[2:4], *element[:2], -element[4]])
