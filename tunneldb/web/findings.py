"""Requests on findings: work list, one finding, review, undo and drawing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from starlette.responses import JSONResponse, Response

from tunneldb.errors import UserError
from tunneldb.store.desk import findings
from tunneldb.web.route import Call, ConflictError, NotFoundError
from tunneldb.web.sessions import Connection
from tunneldb.web.surveys import survey_of


def worklist(call: Call) -> Any:
    """Return the findings to review, in order."""
    order = call.query.get("order", ["likely"])[0]
    if order not in findings.ORDERS:
        raise UserError(f"order={order[:40]}: one of {', '.join(findings.ORDERS)}")
    low, high, area = call.number("from", -np.inf), call.number("to", np.inf), call.number("min_area", 0.0)
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        return findings.worklist(conn, survey.id, order, call.query.get("kind", []), low, high, area)


def one(call: Call) -> Any:
    """Return a finding."""
    with call.session.connection() as conn:
        return _finding(conn, call.path["id"])


def review(call: Call) -> Any:
    """Write a review if the finding is as it was seen.

    Raises
    ------
    ConflictError
        If another person has changed it, with the finding as it is.
    """
    body = _object(call.body)
    seen, values = _object(body.get("seen")), _object(body.get("values"))
    if set(seen) != set(findings.REVIEWED) or not values or not set(values) <= set(findings.REVIEWED):
        raise UserError(f"a review states {', '.join(findings.REVIEWED)} as seen, and some of them anew")
    for name, value in (*seen.items(), *values.items()):
        if value is not None and not isinstance(value, str):
            raise UserError(f"{name} is text")
    with call.session.connection() as conn:
        wrote = findings.write_review(conn, call.path["id"], seen, values)
        now = _finding(conn, call.path["id"])
    if not wrote and any(now[name] != value for name, value in values.items()):
        by = now["reviewed_by"] or "another person"
        raise ConflictError(f"{by} has changed finding {now['id']} in the meantime; nothing was written", finding=now)
    return {"written": wrote, "finding": now}


def undo(call: Call) -> Any:
    """Undo the last change of a finding."""
    with call.session.connection() as conn:
        return {"undone": findings.undo(conn, call.path["id"]), "finding": findings.finding(conn, call.path["id"])}


def draw(call: Call) -> Response:
    """Add a drawn finding.

    With ``again`` the request was sent before and its answer was lost: if it was done then, return that finding.
    """
    body = _object(call.body)
    values = {name: body.get(name) for name in ("kind", "severity", "width_mm", "remark")}
    for name, types in (("kind", str), ("severity", int | None), ("width_mm", int | float | None), ("remark", str | None)):
        if not isinstance(values[name], types) or isinstance(values[name], bool):
            raise UserError(f"{name} is missing, or of a wrong type")
    if not isinstance(body.get("again", False), bool):
        raise UserError("again is true or false")
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        key = findings.draw(conn, survey.name, _object(body.get("geometry")), values, again=body.get("again", False))
        return JSONResponse(_finding(conn, key), 201)


def redraw(call: Call) -> Any:
    """Replace the outline of a finding."""
    geometry = _object(_object(call.body).get("geometry"))
    with call.session.connection() as conn:
        if not findings.redraw(conn, call.path["id"], geometry):
            raise _gone(call.path["id"])
        return _finding(conn, call.path["id"])


def split(call: Call) -> Any:
    """Split a finding by a line."""
    line = _object(_object(call.body).get("line"))
    with call.session.connection() as conn:
        return {"ids": findings.split(conn, call.path["id"], line)}


def merge(call: Call) -> Any:
    """Merge findings."""
    ids = _object(call.body).get("ids")
    if not isinstance(ids, list) or not all(type(one) is int and 0 < one < 2**63 for one in ids) or len(ids) > 1000:
        raise UserError("ids is a list of at most 1000 numbers of findings")
    with call.session.connection() as conn:
        return {"id": findings.merge(conn, ids)}


def delete(call: Call) -> Response:
    """Delete a drawn finding."""
    with call.session.connection() as conn:
        if not findings.delete(conn, call.path["id"]):
            raise _gone(call.path["id"])
    return Response(status_code=204)


def _finding(conn: Connection, key: int) -> dict[str, Any]:
    found = findings.finding(conn, key) if key < 2**63 else None
    if found is None:
        raise _gone(key)
    return found


def _gone(key: int) -> NotFoundError:
    return NotFoundError(f"finding {key} does not exist")


def _object(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise UserError("the body of the request lacks an object")
    return value
