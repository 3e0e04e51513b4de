"""Requests of the 3D view: points of a stretch, and outlines of its findings in space."""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from starlette.responses import Response

from tunneldb.arrays import Float, Single
from tunneldb.classification.classes import PointClass
from tunneldb.errors import UserError
from tunneldb.export.images.tile_png import Stretch, is_signed
from tunneldb.export.pointcloud.point_buffer import greys, millimetres, point_buffer
from tunneldb.geometry.surface import Surface
from tunneldb.raster.point_values import values_at
from tunneldb.store.desk import points as stored
from tunneldb.store.desk.images import KINDS, image_kinds
from tunneldb.store.desk.points import PointSample
from tunneldb.store.desk.surveys import Place
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.sessions import Connection
from tunneldb.web.surveys import measured, survey_of
from tunneldb.web.tile_source import PERCENTILES, stretch_images, survey_stretch

MAX_LENGTH = 50.0
"""Maximum length of a stretch, m."""

POINTS, MIN_POINTS, MAX_POINTS = 300_000, 1000, 1_000_000
"""Maximum number of points of an answer, unless ``limit`` states another, and the least and greatest limit."""

AXIS_STEP = 1.0
"""Distance between the places of the axis in an answer, m."""

BESIDE_LINING = (PointClass.APPENDAGE, PointClass.RAIL, PointClass.OBJECT, PointClass.SPHERE, PointClass.NOISE)
"""Classes of points to which the images of the lining behind them do not apply."""

Colour = tuple[dict[str, Any], NDArray[Any]]
"""A colour for points, with its values: greys, or mm."""


def points(call: Call) -> Response:
    """Return the points of a stretch with what they are coloured by (tunneldb.export.pointcloud.point_buffer)."""
    limit = call.number("limit", POINTS)
    if not MIN_POINTS <= limit <= MAX_POINTS:
        raise UserError(f"limit={limit:g}: {MIN_POINTS:,} to {MAX_POINTS:,} points")
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        low, high = _stretch(call, survey)
        sample = stored.load_points(conn, survey.id, low, high, int(limit))
        if not len(sample.xyz):
            raise NotFoundError(
                f"no points of {survey.name} are stored from {low:.1f} to {high:.1f} m:"
                " no scan covers this stretch, or its scans were removed"
            )
        surface = stored.load_surface(conn, survey.id, low, high)
        colours = [*_raw(conn, survey, sample), *_of_images(call, conn, survey, sample, surface, (low, high))]
    axis = _axis(surface, low, high)
    origin = axis[len(axis) // 2, 1:].round()
    header = {
        "survey": survey.name, "from": low, "to": high, "count": len(sample.xyz), "total": sample.total,
        "origin": origin.tolist(), "axis": (axis - [0.0, *origin]).round(4).tolist(),
        "colours": [about for about, _ in colours],
    }  # fmt: skip
    arrays: dict[str, NDArray[Any]] = {"xyz": (sample.xyz - origin).astype(np.float32), "class": sample.classes}
    return _packed(call, point_buffer(header, arrays | {about["kind"]: values for about, values in colours}))


def outlines(call: Call) -> Any:
    """Return the findings of a stretch with their outlines in space."""
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        return stored.outlines(conn, survey.id, *_stretch(call, survey))


def _stretch(call: Call, survey: Place) -> tuple[float, float]:
    """Return the stretch of a request, within the survey, m."""
    first, last = measured(survey)
    low, high = call.number("from", np.nan), call.number("to", np.nan)
    if not low < high:
        raise UserError("state a stretch: from, and to, which is greater")
    if high - low > MAX_LENGTH + 1e-6:
        raise UserError(f"the stretch is {high - low:.1f} m long: at most {MAX_LENGTH:.0f} m")
    low, high = max(low, first), min(high, last, low + MAX_LENGTH)
    if not low < high:
        raise UserError(f"the stretch is outside the survey, which reaches from {first:.1f} to {last:.1f} m")
    if high - low > MAX_LENGTH:  # by rounding
        high = float(np.nextafter(high, low))
    return low, high


def _axis(surface: Surface, low: float, high: float) -> Float:
    """Return places of the axis (n, 4): chainage and x, y, z, m."""
    chainage = np.linspace(low, high, max(2, int(np.ceil((high - low) / AXIS_STEP)) + 1))
    axis = np.column_stack([chainage, surface.frames(chainage)[:, 0]])
    return axis[np.isfinite(axis).all(axis=1)]


def _raw(conn: Connection, survey: Place, sample: PointSample) -> Iterator[Colour]:
    """Yield the points' own intensity, if the survey has one."""
    unit = stored.intensity_unit(conn, survey.id)
    if unit is None:
        return
    low, high = (float(v) for v in np.percentile(sample.intensity, PERCENTILES))
    about = {"kind": "raw", "label": KINDS["raw"][0], "unit": unit, "low": low, "high": high, "signed": False}
    yield about, greys(sample.intensity, Stretch(low, high))


def _of_images(
    call: Call, conn: Connection, survey: Place, sample: PointSample, surface: Surface, ends: tuple[float, float]
) -> Iterator[Colour]:
    """Yield the offset of the points, and what the images of the lining have at them."""
    kinds = [kind for kind in image_kinds(conn, survey.id) if kind == "corrected" or is_signed(kind)]
    if not kinds or not len(surface.chainages):
        return
    place = surface.unroll(sample.xyz)
    chainage = np.where(np.isin(sample.classes, BESIDE_LINING), np.nan, place.chainage)
    for kind in kinds:
        if kind == "offset":
            values = place.offset.astype(np.float32)
        else:
            values = values_at(stretch_images(call.desk.blocks, conn, survey, kind, ends), chainage, place.arc)
        stretch = survey_stretch(call.desk.blocks, conn, survey, kind)
        yield _described(kind, stretch), _coded(kind, values, stretch)


def _described(kind: str, stretch: Stretch) -> dict[str, Any]:
    label, unit = KINDS[kind]
    return {"kind": kind, "label": label, "unit": unit, "low": stretch.low, "high": stretch.high, "signed": is_signed(kind)}


def _coded(kind: str, values: Single, stretch: Stretch) -> NDArray[Any]:
    return millimetres(values) if is_signed(kind) else greys(values, stretch)


def _packed(call: Call, content: bytes) -> Response:
    """Return an answer that is compressed here, in a thread of its own and fast."""
    headers = {"Vary": "Accept-Encoding"}
    if "gzip" in call.headers.get("accept-encoding", ""):
        content = gzip.compress(content, 1)
        headers["Content-Encoding"] = "gzip"
    return Response(content, media_type="application/octet-stream", headers=headers)
