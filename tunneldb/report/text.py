"""Numbers, moments and tallies of a report as text."""

from __future__ import annotations

import datetime as dt
import json
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
import shapely
from markupsafe import Markup

from tunneldb.numerals import percent_number
from tunneldb.report.data import Edit, Row

DASH = "–"
SPACE = "\u202f"
"""Between thousands."""


def percent(share: float | None, decimals: int = 1) -> str:
    """Return a share in per cent; 100 % only for all, 0 % only for nothing."""
    return DASH if share is None else f"{percent_number(share, decimals)} %"


def number(value: float | None, decimals: int = 2) -> str:
    """Return a number with so many decimals and thousands separators; a dash for None."""
    return DASH if value is None else f"{value:,.{decimals}f}".replace(",", SPACE).replace("-", "−")


def signed(value: float) -> str:
    """Return a length in m with its sign, as of an arc."""
    return f"{round(value, 2) + 0.0:+.2f}".replace("-", "−")


def whole(value: float | None) -> str:
    """Return a whole number with thousands separators; a dash for None."""
    return number(value, 0)


def rounded(value: float | None, decimals: int) -> float | None:
    """Round a value that may be None."""
    return None if value is None else round(value, decimals)


def when(moment: dt.datetime) -> str:
    """Return a time to the minute, UTC."""
    return moment.astimezone(dt.UTC).strftime("%Y-%m-%d %H:%M UTC")


def day(date: dt.date) -> str:
    """Return a date with the month's name: 4 May 2024."""
    return f"{date.day} {date:%B %Y}"


def size(count: int) -> str:
    """Return bytes in a suitable unit."""
    value = float(count)
    for unit in ("B", "kB", "MB", "GB"):
        if value < 1000:
            return f"{value:.3g} {unit}"
        value /= 1000
    return f"{value:.3g} TB"


def short(label: str) -> str:
    """Label of a chainage without decimals that say nothing: 12+300.000 is 12+300."""
    return label.rstrip("0").rstrip(".") if "." in label else label


def kilometres(numbers: Iterable[int]) -> str:
    """Return kilometres with ranges combined: 12, 14–17."""
    parts = []
    for _, group in groupby(enumerate(sorted(numbers)), key=lambda pair: pair[1] - pair[0]):
        row = [km for _, km in group]
        parts.append(str(row[0]) if len(row) == 1 else f"{row[0]}{DASH}{row[-1]}")
    return ", ".join(parts)


def css(value: str) -> str:
    """Escape text for a string in a style sheet, so that it cannot end the string."""
    return "".join(c if c.isalnum() or c in " .,:;·–-_+()/" else f"\\{ord(c):x} " for c in value)


def counters(text: str) -> str:
    """Return text with {page} and {pages} as content of a style sheet: strings between page counters."""
    parts = re.split(r"\{(pages?)\}", text)
    return " ".join(f"counter({part})" if n % 2 else f'"{css(part)}"' for n, part in enumerate(parts) if part)


def stale(rows: Sequence[Row]) -> dict[str, list[tuple[str, str]]]:
    """Return the stages that are out of date, with kilometres and reasons; staleness caused by another stage is no reason."""
    stages: defaultdict[str, set[int]] = defaultdict(set)
    reasons: defaultdict[str, set[int]] = defaultdict(set)
    for row in rows:
        stages[row["stage"]].update(row["kilometres"])
        if not row["inherited"]:
            reasons[row["reason"]].update(row["kilometres"])
    return {
        "stages": [(stage, kilometres(numbers)) for stage, numbers in stages.items()],
        "reasons": [(reason, kilometres(numbers)) for reason, numbers in sorted(reasons.items())],
    }


def versions(runs: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the sets of versions, with the stages and kilometres of each."""
    by: defaultdict[str, list[Row]] = defaultdict(list)
    for run in runs:
        by[", ".join(f"{name} {value}" for name, value in sorted(run["versions"].items()))].append(run)
    return [
        {
            "versions": names,
            "stages": ", ".join(dict.fromkeys(run["stage"] for run in theirs)),
            "kilometres": kilometres({km for run in theirs for km in run["kilometres"]}),
        }
        for names, theirs in by.items()
    ]


def crs(definition: str) -> str:
    """Return AUTHORITY:CODE unchanged; for a definition its name, the first quoted text."""
    return definition.split('"')[1] if '"' in definition else definition


def script_json(value: Any) -> Markup:
    """Return JSON that is safe in a script element."""
    plain = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return Markup(plain.replace("<", "\\u003c"))


_WHAT = {
    "finding": "finding",
    "axis_vertex": "axis vertex",
    "region": "region",
    "spot": "spot",
    "photo": "photo",
    "action": "action",
}


def edit(entry: Edit, spots: Mapping[int, int]) -> dict[str, str]:
    """Describe a manual edit: person and time, object, and old and new value of each column.

    People know spots by their numbers, which ``spots`` has by key; of one that is gone the key is all that is left.
    """
    before, after = entry.before or {}, entry.after or {}
    which = str(entry.row_id if entry.view != "spot" else spots.get(entry.row_id, f"no longer existing, key {entry.row_id}"))
    if entry.action == "update":
        changes = "; ".join(_change(name, before.get(name), after.get(name)) for name in sorted({*before, *after}))
    else:
        changes = _come_or_gone(entry.view, before, after)
    if finding := {**before, **after}.get("finding_id"):
        which += f" of finding {finding}"
    return {"at": when(entry.at), "who": entry.who, "what": f"{_WHAT[entry.view]} {which}", "change": changes}


def _come_or_gone(view: str, before: Row, after: Row) -> str:
    """Describe what was drawn, added, deleted or removed."""
    verb = ("added" if after else "removed") if view in ("photo", "action") else "drawn" if after else "deleted"
    stated = {
        name: value for name, value in (after or before).items() if name not in ("geom", "finding_id") and value is not None
    }
    return verb + (f": {', '.join(f'{name} {value}' for name, value in sorted(stated.items()))}" if stated else "")


def _change(name: str, before: Any, after: Any) -> str:
    """Return the change of a column in words; of a geometry, how far it moved."""
    if name != "geom":
        return f"{name}: {DASH if before in (None, '') else before} → {DASH if after in (None, '') else after}"
    if before is None or after is None:
        return "drawn" if before is None else "deleted"
    old, new = (shapely.get_coordinates(_shape(value), include_z=True) for value in (before, after))
    if len(old) == len(new) == 1:
        return f"moved by {float(np.linalg.norm(np.nan_to_num(new - old))):.3f} m"
    return "drawn anew"


def _shape(ewkt: Any) -> shapely.Geometry:
    """Return the geometry of an EWKT."""
    return shapely.from_wkt(str(ewkt).rpartition(";")[2])
