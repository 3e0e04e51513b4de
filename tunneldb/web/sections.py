"""Requests on sections: values for the page, and a drawing."""

from __future__ import annotations

from typing import Any
from urllib.parse import quote

import numpy as np
from starlette.responses import Response

from tunneldb.errors import UserError
from tunneldb.export.exchange.section_lines import SectionLine, section_lines
from tunneldb.store.desk import sections
from tunneldb.store.desk.sections import Section
from tunneldb.store.desk.surveys import Place
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.surveys import measured, survey_of


def section(call: Call) -> Any:
    """Return the section at a chainage."""
    _, chainage, label, found, lines = _section(call)
    return {
        "chainage": chainage,
        "label": label,
        "points": np.column_stack([found.points.round(3), found.classes]).tolist(),
        "curve": found.curve.round(4).tolist(),
        "centre": [0, 0],
        "lines": [{"kind": line.kind, "name": line.name, "places": line.places.round(4).tolist()} for line in lines],
    }


def drawing(call: Call) -> Response:
    """Return the section at a chainage as a DXF drawing."""
    from tunneldb.export.exchange.section_dxf import section_dxf  # its library is large

    survey, chainage, label, found, lines = _section(call)
    text = section_dxf(f"{survey.name}  {label}", found, lines)
    name = f"section-{survey.name}-{chainage:.2f}.dxf"
    coded = quote(name, safe="")
    shown = f'filename="{name}"' if coded == name else f"filename*=utf-8''{coded}"
    return Response(text, media_type="image/vnd.dxf", headers={"Content-Disposition": f"attachment; {shown}"})


def _section(call: Call) -> tuple[Place, float, str, Section, list[SectionLine]]:
    """Return the survey, chainage and its label, section and its lines that are asked for."""
    chainage = call.number("chainage", np.nan)
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        low, high = measured(survey)
        if not low <= chainage <= high:
            raise UserError(f"chainage={chainage:g}: the survey reaches from {low:.1f} to {high:.1f} m")
        found = sections.load_section(conn, survey.id, survey.name, chainage)
        if found is None:
            raise NotFoundError(f"no section is near chainage {chainage:.1f} m")
        lines = section_lines(conn, survey.tunnel_id, survey.id, found.frame)
        return survey, chainage, sections.station_label(conn, survey.tunnel_id, chainage), found, lines
