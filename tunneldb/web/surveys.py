"""Requests on surveys: list, one survey, its ribbon."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tunneldb.errors import UserError
from tunneldb.export.images.palette import BLUE, PALETTES, RED, WHITE, hexadecimal, ramp_colours
from tunneldb.export.images.tile_png import is_signed
from tunneldb.finding_kind import FindingKind
from tunneldb.store.desk import surveys
from tunneldb.store.desk.images import KINDS, ImageKind, find_image, images
from tunneldb.store.desk.surveys import Place
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.sessions import Connection
from tunneldb.web.tile_source import survey_stretch

BINS = 1500
"""Maximum number of bins of a ribbon."""

SHORTEST_BIN = 1.0
"""Minimum length of a bin of a ribbon, m."""

KIND_COLOURS = {
    FindingKind.LEAK: "#005caf", FindingKind.DRIP: "#0aa0c8", FindingKind.CRACK: "#b8171d", FindingKind.SPALL: "#e0660b",
    FindingKind.DELAMINATION: "#c9a100", FindingKind.EFFLORESCENCE: "#8a5fb0", FindingKind.DAMAGED_JOINT: "#a0522d",
    FindingKind.MISSING_BOLT: "#d0408f", FindingKind.CORRODED: "#7a4a1e", FindingKind.OBSTRUCTION: "#444444",
    FindingKind.JOINT: "#7f8a94", FindingKind.DARK: "#6e6e6e",
}  # fmt: skip
"""Colours of the kinds of findings."""

OTHER_COLOUR = "#3a8f5c"
"""Colour of a kind without one of its own."""


def survey_of(conn: Connection, name: str) -> Place:
    """Return the survey of a tunnel with a name, which has an axis.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    survey = surveys.find_survey(conn, name)
    if survey is None:
        raise NotFoundError(f"there is no survey {name[:80]!r} of a tunnel")
    return survey


def measured(survey: Place) -> tuple[float, float]:
    """Return the ends of a survey's axis, m; raise UserError if it has none."""
    if survey.low is None or survey.high is None:
        raise UserError(f"survey {survey.name} has no axis yet: tunneldb run {survey.name}")
    return survey.low, survey.high


def list_all(call: Call) -> Any:
    """Return all surveys."""
    with call.session.connection() as conn:
        return surveys.list_surveys(conn)


def tunnels(call: Call) -> Any:
    """Return the tunnels for the map."""
    with call.session.connection() as conn:
        return surveys.tunnels(conn)


def one(call: Call) -> Any:
    """Return a survey with what is needed to show it."""
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        low, high = measured(survey)
        ends = surveys.arcs(conn, survey.id) or (0.0, 0.0)
        kinds = [
            {
                "kind": image.kind, "label": image.label, "unit": image.unit, "signed": is_signed(image.kind),
                "ramp": _ramp(image),
            }
            for image in images(conn, survey.id)
        ]  # fmt: skip
        return {
            "id": survey.id, "name": survey.name, "tunnel": survey.tunnel, "date": survey.date, "from": low, "to": high,
            "arc_from": ends[0], "arc_to": ends[1], "kinds": kinds,
            "finding_kinds": [{**k, "colour": KIND_COLOURS.get(k["code"], OTHER_COLOUR)} for k in surveys.finding_kinds(conn)],
            "severities": surveys.severities(conn), "neighbours": surveys.neighbours(conn, survey),
        }  # fmt: skip


def _ramp(image: ImageKind) -> list[str]:
    """Return the colours of an image from its least to its greatest value; none of one with colours or codes."""
    if image.colour or image.palette in PALETTES:
        return []
    return [hexadecimal(colour) for colour in (BLUE, WHITE, RED)] if is_signed(image.kind) else ramp_colours(image.palette)


def summary(call: Call) -> Any:
    """Return the statistics of a whole survey, its remarks, and where leaks could be missed: slow for a long one."""
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        return {
            **surveys.statistics(conn, survey),
            "remarks": surveys.remarks(conn, survey.id),
            "statement": surveys.statement(conn, survey.id),
        }


def colours(call: Call) -> Any:
    """Return the values of the darkest and the brightest colour of an image."""
    kind = call.path["kind"]
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        if find_image(conn, survey.id, kind) is None:
            raise no_kind(kind)
        stretch = survey_stretch(call.desk.blocks, conn, survey, kind)
    return {"low": stretch.low, "high": stretch.high}


def no_kind(kind: str) -> NotFoundError:
    """Return the error for a kind of image that does not exist."""
    return NotFoundError(f"there is no kind of image {kind[:40]!r}: there are {', '.join(KINDS)}")


def ribbon(call: Call) -> Any:
    """Return the whole survey in bins."""
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        low, high = measured(survey)
        bins = int(np.clip((high - low) / SHORTEST_BIN, 1, BINS))
        rows = surveys.ribbon(conn, survey, bins)
    kinds = sorted({kind for row in rows for kind in row[2]})
    counts = [sum(row[2].values()) for row in rows]
    return {
        "from": low,
        "to": high,
        "step": (high - low) / bins,
        "inspected": [row[0] for row in rows],
        "wet": [row[1] for row in rows],
        "findings": {kind: [row[2].get(kind, 0) for row in rows] for kind in kinds},
        "reviewed": [row[3] / count if count else None for row, count in zip(rows, counts, strict=True)],
        "probability": [row[4] for row in rows],
        "deviation": _deviation(rows),
    }


def _deviation(rows: Sequence[tuple[Any, ...]]) -> dict[str, Any] | None:
    """Return layer and deviations of the bins, m; None if no deviation was measured."""
    layer = next((row[5] for row in rows if row[5] is not None), None)
    return None if layer is None else {"layer": layer, "least": [row[6] for row in rows], "greatest": [row[7] for row in rows]}
