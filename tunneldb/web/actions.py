"""Requests on actions: those of a tunnel; add, change and delete one."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Mapping
from typing import Any

from starlette.responses import JSONResponse, Response

from tunneldb.errors import UserError
from tunneldb.store.desk import actions
from tunneldb.web.route import Call, ConflictError, NotFoundError
from tunneldb.web.sessions import Connection
from tunneldb.web.surveys import survey_of

_NUMBERS = ("cost", "chainage_from", "chainage_to")

_TYPES = {"finding_id": "the number of a finding", "due": "a date as 2030-01-31"} | dict.fromkeys(_NUMBERS, "a number")


def of_survey(call: Call) -> Any:
    """Return the actions of the survey's tunnel, overdue ones first."""
    with call.session.connection() as conn:
        return actions.of_tunnel(conn, survey_of(conn, call.path["survey"]).tunnel_id)


def add(call: Call) -> Response:
    """Add an action that the survey demands."""
    values = _values(call.body)
    if not values.get("measure"):
        raise UserError("measure is missing: what is to be done")
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        return JSONResponse(_action(conn, actions.add(conn, survey.name, values)), 201)


def change(call: Call) -> Any:
    """Write values of an action if they are as they were seen.

    Raises
    ------
    ConflictError
        If another person has changed one of them, with the action as it is.
    """
    body = _object(call.body)
    values, seen = _values(body.get("values")), _values(body.get("seen"))
    if not values or set(values) != set(seen):
        raise UserError("a change states values, and the same columns as seen")
    key = call.path["id"]
    with call.session.connection() as conn:
        wrote = actions.change(conn, key, seen, values)
        now = _action(conn, key)
    if not wrote and any(now[name] != value for name, value in values.items()):
        by = now["changed_by"] or "another person"
        raise ConflictError(f"{by} has changed action {key} in the meantime; nothing was written", action=now)
    return {"written": wrote, "action": now}


def delete(call: Call) -> Response:
    """Delete an action."""
    with call.session.connection() as conn:
        if not actions.delete(conn, call.path["id"]):
            raise _gone(call.path["id"])
    return Response(status_code=204)


def _action(conn: Connection, key: int) -> dict[str, Any]:
    found = actions.action(conn, key)
    if found is None:
        raise _gone(key)
    return found


def _gone(key: int) -> NotFoundError:
    return NotFoundError(f"action {key} does not exist")


def _values(value: Any) -> dict[str, Any]:
    """Return values of an action, each a text, or a number where it is one; None for none."""
    values = dict(_object(value))
    for name, one in values.items():
        if name not in actions.WRITTEN:
            raise UserError(f"{name[:40]}: an action has {', '.join(actions.WRITTEN)}")
        if one is None:
            continue
        if name == "finding_id":
            fits = type(one) is int and 0 < one < 2**63
        elif name in _NUMBERS:
            fits = type(one) in (int, float) and math.isfinite(one)
        elif name == "due":
            fits = isinstance(one, str) and _is_date(one)
        else:
            fits = isinstance(one, str)
        if not fits:
            raise UserError(f"{name} is not {_TYPES.get(name, 'a text')}")
    return values


def _is_date(text: str) -> bool:
    """Return True for a date as 2030-01-31: the database takes words such as tomorrow, too."""
    try:
        return str(dt.date.fromisoformat(text)) == text
    except ValueError:
        return False


def _object(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise UserError("the body of the request lacks an object")
    return value
