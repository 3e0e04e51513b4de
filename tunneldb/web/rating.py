"""Requests on ratings: what can be chosen, the rating of a survey, and its change since the earlier inspection."""

from __future__ import annotations

from typing import Any

from tunneldb.errors import UserError
from tunneldb.store.desk import rating
from tunneldb.store.desk.surveys import Place
from tunneldb.web.route import Call, NotFoundError
from tunneldb.web.sessions import Connection
from tunneldb.web.surveys import survey_of


def choices(call: Call) -> Any:
    """Return the divisions of the tunnel and the schemes."""
    with call.session.connection() as conn:
        survey = survey_of(conn, call.path["survey"])
        return {"element_sets": rating.element_sets(conn, survey), "schemes": rating.schemes(conn)}


def one(call: Call) -> Any:
    """Return the rating of each element, with the scheme."""
    with call.session.connection() as conn:
        survey, elements, scheme = _asked(call, conn)
        return {"scheme": scheme, "elements": rating.rating(conn, survey, elements, scheme["name"], scheme["version"])}


def change(call: Call) -> Any:
    """Return the change of each element's rating, with the earlier survey; it takes twice as long as the rating."""
    with call.session.connection() as conn:
        survey, elements, scheme = _asked(call, conn)
        rows = rating.change(conn, survey, elements, scheme["name"], scheme["version"])
    earlier = next(
        ({"survey": row["earlier_survey"], "date": row["earlier_date"]} for row in rows if row["earlier_survey"]), None
    )
    kept = ("id", "earlier_result", "change", "known")
    return {"earlier": earlier, "elements": [{name: row[name] for name in kept} for row in rows]}


def _asked(call: Call, conn: Connection) -> tuple[Place, str, dict[str, Any]]:
    """Return survey, division and scheme of a request; without a version the one added last.

    Raises
    ------
    NotFoundError
        If one of them does not exist.
    """
    elements, name, version = (call.query.get(key, [""])[0] for key in ("elements", "scheme", "version"))
    if not elements or not name:
        raise UserError("a rating needs elements=NAME and scheme=NAME")
    survey = survey_of(conn, call.path["survey"])
    if all(one["name"] != elements for one in rating.element_sets(conn, survey)):
        raise NotFoundError(f"the tunnel of survey {survey.name} has no elements {elements[:80]!r}")
    for scheme in rating.schemes(conn):
        if scheme["name"] == name and version in ("", scheme["version"]):
            return survey, elements, scheme
    raise NotFoundError(f"there is no rating scheme {name[:80]!r} {version[:40]}".rstrip())
