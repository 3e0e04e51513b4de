"""Lines of DXF drawings, by ezdxf."""

from __future__ import annotations

import io
import itertools
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from tunneldb.alignment.design import MAX_LENGTH
from tunneldb.alignment.drawing import MAX_COORDINATE, Drawn, choose_layer, drawn_lines
from tunneldb.alignment.joining import join_pieces
from tunneldb.alignment.units import UNITS
from tunneldb.arrays import Float
from tunneldb.counted import counted
from tunneldb.errors import InputError
from tunneldb.files import require_at_most

CHORD_ERROR = 0.0005  # m, of arcs and splines
MAX_STEP = 1.0  # m between vertices of a drawing with arcs, so that the spline through them keeps straights straight
_ENTITIES = {"LINE", "ARC", "LWPOLYLINE", "POLYLINE", "SPLINE", "HELIX", "ELLIPSE"}
_FRAME = 16  # flag of a vertex of a spline's control frame, which is no part of the line
_MAX_VERTICES = 1e6  # of a line; longer ones are damage, which is refused later
_MAX_CURVE_VERTICES = 200_000  # of all curves: 126 km at a radius of 100 m
_MAX_NESTING = 16  # blocks in blocks
_MAX_IN_BLOCKS = 10_000  # entities
_MAX_LISTED = 6
_MAX_ENTITIES = 20_000  # of the axis: 20 km of pieces of 1 m
_MAX_MEGABYTES = 100  # ezdxf takes ten times that of memory, and a minute or more

_INSUNITS = {
    1: ("inches", "inch"), 2: ("feet", "foot"), 3: ("miles", "mile"), 4: ("millimetres", "millimeter"),
    5: ("centimetres", "centimeter"), 6: ("metres", "meter"), 7: ("kilometres", "kilometer"), 8: ("microinches", None),
    9: ("mils", None), 10: ("yards", None), 11: ("angstroms", None), 12: ("nanometres", None), 13: ("microns", None),
    14: ("decimetres", None), 15: ("decametres", None), 16: ("hectometres", None), 17: ("gigametres", None),
    18: ("astronomical units", None), 19: ("light years", None), 20: ("parsecs", None),
    21: ("US survey feet", "USSurveyFoot"), 22: ("US survey inches", None), 23: ("US survey yards", None),
    24: ("US survey miles", None),
}  # fmt: skip
"""Name of each unit of $INSUNITS, and its name in `UNITS`."""


def read_dxf(path: Path, layer: str | None, unit: float | None) -> Drawn:
    """Read the lines of a DXF file's model space: LINE, ARC, LWPOLYLINE, POLYLINE, SPLINE, HELIX and ELLIPSE.

    Lines in blocks are read if the layer has no others.

    Parameters
    ----------
    layer
        Name of the layer; required if several contain lines.
    unit
        Metres per drawing unit; None for the file's own unit.

    Raises
    ------
    InputError
        If it can't be read, has no lines, has several layers to choose from, or its unit isn't the metre.
    """
    drawing, repaired = open_drawing(path)
    with _damage(path):
        return _lines(path, drawing, layer, unit, repaired)


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """Report what ezdxf raises for entities that are damaged or incomplete."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path} is damaged: {_line_of(error)}; repair it in a CAD program (AUDIT) and save it") from error


def _lines(path: Path, drawing: Any, layer: str | None, unit: float | None, repaired: str) -> Drawn:
    placed = [(entity, entity.dxf.layer) for entity in drawing.modelspace() if _is_line(entity)]
    left_out = {insert.dxf.layer for insert in drawing.modelspace().query("INSERT") if any(map(_is_line, insert.block() or ()))}
    in_blocks = not placed or (layer is not None and layer not in {name for _, name in placed})
    if in_blocks:
        placed += _lines_in_blocks(path, drawing)
    names = sorted({name for _, name in placed})
    if not names:
        raise InputError(f"{path} holds no lines{_others(drawing)}; draw the axis as a line in model space")
    chosen = choose_layer(path, names, layer)
    scale, note = _dxf_unit(path, drawing.header.get("$INSUNITS", 0), unit)
    of_layer = [entity for entity, name in placed if name == chosen]
    if len(of_layer) > _MAX_ENTITIES:
        raise InputError(
            f"{path}: layer {chosen!r} has {len(of_layer)} lines and arcs, an axis has at most {_MAX_ENTITIES}; write the axis"
            " alone to a file"
        )
    parts = [part for entity in of_layer for part in _simple(entity)]
    curved = any(part.dxftype() != "LINE" for part in parts)
    pieces = [scale * piece for piece in _flattened(path, parts, scale)]
    broken = sum(not (np.abs(piece) <= MAX_COORDINATE).all() for piece in pieces)
    if broken:
        raise InputError(f"{path}: {counted(broken, 'line')} of layer {chosen!r} with invalid coordinates; draw them again")
    lines = [_densified(line) if curved else line for line in join_pieces(pieces)]
    in_block = (
        "is in blocks" if in_blocks else f"has blocks with lines on layer {chosen!r}; left out" if chosen in left_out else ""
    )
    return drawn_lines(path, lines, chosen, tuple(text for text in (repaired, note, in_block) if text))


def open_drawing(path: Path) -> tuple[Any, str]:
    """Open a DXF file; return the drawing, and a note if it is damaged and was repaired, else an empty one.

    Raises
    ------
    InputError
        If it can't be read.
    """
    from ezdxf import filemanagement, recover

    with suppress(OSError):  # of which ezdxf says more
        require_at_most(path, _MAX_MEGABYTES, "a drawing")
    try:
        return filemanagement.readfile(str(path)), ""
    except Exception as error:  # for damaged files ezdxf raises StopIteration, OverflowError and others
        fault = _line_of(error)
    if "floating point" in fault:  # ezdxf would cut off digits after a decimal comma
        raise InputError(f"{path} cannot be read as DXF: {fault} Export it again, with decimal points")
    try:
        drawing, auditor = recover.read(io.BytesIO(path.read_bytes().removeprefix(b"\xef\xbb\xbf")))
        if not len(drawing.modelspace()):
            raise InputError(f"{path} cannot be read as DXF: {fault}")
    except InputError:
        raise
    except Exception:
        raise InputError(f"{path} cannot be read as DXF: {fault}") from None
    faults = max(1, len(auditor.fixes) + len(auditor.errors))
    return drawing, f"is damaged ({fault}) and was repaired, {counted(faults, 'fault')}; check that the axis is complete"


def unit_name(code: int) -> str:
    """Return the name of a unit of $INSUNITS."""
    return _INSUNITS[code][0] if code in _INSUNITS else f"number {code}"


def _line_of(error: Exception) -> str:
    message = str(error).strip().splitlines() or [f"it is damaged ({type(error).__name__})"]
    return "".join(letter if letter.isprintable() else "?" for letter in message[0])


def _is_line(entity: Any) -> bool:
    mesh = entity.dxftype() == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh)
    return entity.dxftype() in _ENTITIES and not mesh


def _lines_in_blocks(path: Path, drawing: Any) -> list[tuple[Any, str]]:
    """Return the lines in blocks of the model space, in its coordinates, with their layers."""
    found = (entity for insert in drawing.modelspace().query("INSERT") for entity in _exploded(insert, _MAX_NESTING))
    entities = list(itertools.islice(found, _MAX_IN_BLOCKS + 1))
    if len(entities) > _MAX_IN_BLOCKS:
        raise InputError(f"{path}: its blocks hold more than {_MAX_IN_BLOCKS} entities; write the axis alone to a file")
    return [(entity, entity.dxf.layer) for entity in entities if _is_line(entity)]


def _exploded(insert: Any, nesting: int) -> Iterator[Any]:
    """Yield the entities of a block reference, also of those in it; those on layer 0 are on the layer of the reference."""
    for one in insert.multi_insert() if insert.mcount > 1 else [insert]:
        for entity in one.virtual_entities():
            if entity.dxf.layer == "0":
                entity.dxf.layer = insert.dxf.layer
            yield entity
            if entity.dxftype() == "INSERT" and nesting:
                yield from _exploded(entity, nesting - 1)


def _others(drawing: Any) -> str:
    """Return what a drawing without lines holds instead, for a message."""
    kinds = Counter(entity.dxftype() for entity in drawing.modelspace())
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common(_MAX_LISTED))
    sheets = [sheet.name for sheet in drawing.layouts if sheet.name != "Model" and any(map(_is_line, sheet))]
    return (f", but {listed}" if listed else "") + (f" (layout {sheets[0]!r} has some)" if sheets else "")


def _dxf_unit(path: Path, code: int, unit: float | None) -> tuple[float, str]:
    """Return the metres per drawing unit, and a note about it."""
    if unit is not None:
        stated = f"; the file states {unit_name(code)}" if code else ""
        return unit, f"unit: {unit:.9g} m, as given{stated}"
    name, option = _INSUNITS.get(code, (f"number {code}", None))
    if option == "meter":
        return 1.0, ""
    if code == 0:
        return 1.0, "states no unit; using metres, the unit of the SRID"
    advice = f"if its lengths are in {name}, pass --axis-unit {option}; if they" if option in UNITS else "if its lengths"
    raise InputError(
        f"{path}: its unit is {name} ($INSUNITS {code}), which templates often state by mistake; {advice} are in metres, "
        "pass --axis-unit meter"
    )


def _simple(entity: Any) -> list[Any]:
    """Return the lines and arcs of a polyline, else the entity itself."""
    if entity.dxftype() == "POLYLINE":
        entity.vertices[:] = [vertex for vertex in entity.vertices if not vertex.dxf.flags & _FRAME]
    return list(entity.virtual_entities()) if entity.dxftype() in ("LWPOLYLINE", "POLYLINE") else [entity]


def _flattened(path: Path, parts: list[Any], scale: float) -> list[Float]:
    """Return vertices (n, 3) along lines and curves, in the drawing's unit of ``scale`` metres.

    Raises
    ------
    InputError
        If curves are larger, or need more vertices, than those of any tunnel, as an arc whose radius is damaged.
    """
    pieces, left = [], _MAX_CURVE_VERTICES
    for part in parts:
        if part.dxftype() == "LINE":
            vertices = [tuple(part.dxf.start), tuple(part.dxf.end)]
        else:
            if not scale * _size(part) <= MAX_LENGTH:  # also NaN; ezdxf would divide a longer one without end
                raise InputError(
                    f"{path}: the {part.dxftype()} on layer {part.dxf.layer!r} is longer than {MAX_LENGTH / 1000.0:g} km, as no"
                    " tunnel is; draw it again, or pass the unit by --axis-unit"
                )
            vertices = [tuple(vertex) for vertex in itertools.islice(part.flattening(CHORD_ERROR / scale), left + 1)]
            left -= len(vertices)
        if left < 0:
            raise InputError(
                f"{path}: its curves need more than {_MAX_CURVE_VERTICES} vertices; write the axis alone to a file, or pass the"
                " unit by --axis-unit"
            )
        pieces.append(np.array(vertices, dtype=np.float64).reshape(-1, 3))
    return pieces


def _size(curve: Any) -> float:
    """Return the length of a curve or a bound of it, in the drawing's unit."""
    kind = curve.dxftype()
    if kind == "ARC":
        return float(abs(curve.dxf.radius) * np.radians((curve.dxf.end_angle - curve.dxf.start_angle) % 360.0 or 360.0))
    if kind == "ELLIPSE":
        return float(2.0 * np.pi * np.linalg.norm(tuple(curve.dxf.major_axis)) * max(1.0, abs(curve.dxf.ratio)))
    points = [tuple(point) for point in (*curve.control_points, *curve.fit_points)]
    return float(np.linalg.norm(np.diff(np.array(points).reshape(-1, 3), axis=0), axis=1).sum())


def _densified(line: Float) -> Float:
    """Return the same line with vertices at most 1 m apart."""
    length = np.hypot(*np.diff(line[:, :2], axis=0).T)
    parts = np.maximum(np.ceil(length / max(MAX_STEP, length.sum() / _MAX_VERTICES)), 1.0).astype(int)
    within = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    at = np.append(np.repeat(np.arange(len(parts)), parts) + within / np.repeat(parts, parts), float(len(parts)))
    return np.column_stack([np.interp(at, np.arange(len(line)), column) for column in line.T])
