"""Lines of DXF drawings with their layers."""

from __future__ import annotations

import itertools
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from tunneldb.alignment.dxf import open_drawing, unit_name
from tunneldb.arrays import Float
from tunneldb.errors import InputError

CHORD_ERROR = 0.0005
"""Maximum distance of a curve from its vertices' line, m."""

MAX_SIZE = 1e5
"""Maximum extent of a curve, m: a larger one is damage, and would have too many vertices."""

MAX_VERTICES = 20_000
"""Maximum number of vertices of a line, as of a drawn finding."""

_LINES = {"LINE", "LWPOLYLINE", "POLYLINE", "ARC", "SPLINE", "ELLIPSE", "HELIX"}
_METRES = (0, 6)  # $INSUNITS: not stated, metres


def read_drawn_lines(path: Path, layer: str | None) -> tuple[list[tuple[str, Float]], Counter[str]]:
    """Read the lines of a drawing's model space; curves are divided into chords.

    Parameters
    ----------
    path : Path
    layer : str, optional
        Only this layer.

    Returns
    -------
    lines : list of (str, (n, 3) array)
        Layer and vertices of each, m.
    left_out : Counter of str
        Number of other entities by their type.

    Raises
    ------
    InputError
        If it cannot be read, is not in metres, lacks the layer, or has no lines.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    drawing, _ = open_drawing(path)
    unit = drawing.header.get("$INSUNITS", 0)
    if unit not in _METRES:
        raise InputError(
            f"{path}: its unit is {unit_name(unit)} ($INSUNITS {unit}), which templates often state by mistake; scale the"
            " drawing to metres, and set its unit to metres"
        )
    entities = list(drawing.modelspace())
    layers = sorted({entity.dxf.layer for entity in entities if entity.dxftype() in _LINES})
    if layer is not None:
        if layer not in layers:
            raise InputError(f"{path} has no layer {layer!r} with lines: it has {', '.join(layers) or 'none'}")
        entities = [entity for entity in entities if entity.dxf.layer == layer]
    left_out = Counter(entity.dxftype() for entity in entities if entity.dxftype() not in _LINES)
    if not layers:
        raise InputError(f"{path} has no lines in model space{_others(left_out)}")
    lines = [(entity.dxf.layer, _vertices(path, entity)) for entity in entities if entity.dxftype() in _LINES]
    return lines, left_out


def _others(left_out: Counter[str]) -> str:
    listed = ", ".join(f"{number} {what}" for what, number in left_out.most_common(6))
    return f", but {listed}" if listed else ""


def _vertices(path: Path, entity: Any) -> Float:
    """Return the vertices (n, 3) of a line or curve, m."""
    from ezdxf.path import make_path

    where = f"{path}: the {entity.dxftype()} {entity.dxf.handle} on layer {entity.dxf.layer!r}"
    try:
        line = make_path(entity)
        corners = np.array([tuple(vertex) for vertex in line.control_vertices()], dtype=np.float64).reshape(-1, 3)
    except Exception as error:  # ezdxf raises what damage makes it raise
        raise InputError(f"{where} cannot be read; repair the drawing in a CAD program (AUDIT)") from error
    if len(corners) < 2 or not np.ptp(corners, axis=0).max() <= MAX_SIZE:
        raise InputError(f"{where} has no length, or is longer than {MAX_SIZE / 1000:g} km; draw it again, in metres")
    vertices = list(itertools.islice(line.flattening(CHORD_ERROR), MAX_VERTICES + 1))
    if len(vertices) > MAX_VERTICES:
        raise InputError(f"{where} has more than {MAX_VERTICES} vertices; divide it")
    return np.array([tuple(vertex) for vertex in vertices], dtype=np.float64)
