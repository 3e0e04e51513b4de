"""Files of elements (CSV) and of rating schemes (TOML), and the schemes that are part of the program."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tunneldb.csvfile import find_column, read_csv, read_header, read_texts
from tunneldb.errors import InputError, did_you_mean
from tunneldb.store.rating import MEASURES, Element, Limits, Rule, Scheme, Totals
from tunneldb.tomlfile import TomlTable, read_toml

SCHEME_KEYS = ("name", "version", "source", "valid_from", "results", "min_inspected", "totals", "rule")
AXIS_KEYS = ("kinds", "measure", "above", "from")
RULE_KEYS = ("text", *AXIS_KEYS, "points", "by", "results")
MIN_INSPECTED = 0.95
"""Inspected share below which a result is a lower bound, if a scheme does not state another one."""
SHIPPED = Path(__file__).parents[1] / "schemes"
"""Folder of the schemes that are part of the program; a file has the name of its scheme."""


def read_elements(path: Path) -> list[Element]:
    """Read elements: name,chainage_from,chainage_to and perhaps clock_from,clock_to (hours); m.

    Raises
    ------
    InputError
        If the file cannot be read, an element has no length or no name, or a clock position is none; with the line.
    """
    header = read_header(path)
    clocked = find_column(path, header, "clock_from") is not None
    names = ("chainage_from", "chainage_to", *(("clock_from", "clock_to") if clocked else ()))
    table = read_csv(path, names)
    texts = read_texts(path, "name")
    if not len(table):
        raise InputError(f"{path} has no row below its header; it needs one for each element")
    found = []
    for row, name in enumerate(texts):
        low, high = float(table["chainage_from"][row]), float(table["chainage_to"][row])
        if not name.strip():
            raise table.error(row, "the element has no name")
        if not low < high:
            raise table.error(row, f"chainage_to {high:g} is not greater than chainage_from {low:g}")
        clock = (float(table["clock_from"][row]), float(table["clock_to"][row])) if clocked else None
        if clock is not None and (not all(0.0 <= hours <= 12.0 for hours in clock) or clock[0] % 12 == clock[1] % 12):
            raise table.error(row, f"clock_from {clock[0]:g} and clock_to {clock[1]:g} are two different hours from 0 to 12")
        found.append(Element(name.strip(), low, high, clock))
    return found


def stretches_of(length: float, low: float, high: float) -> list[Element]:
    """Return elements of equal length, m, between multiples of it, from one chainage to another."""
    first, last = math.floor(low / length + 1e-9), math.ceil(high / length - 1e-9)
    return [Element(f"{n * length:.10g}", n * length, (n + 1) * length) for n in range(first, last)]


def shipped_scheme(name: str) -> Path:
    """Return the file of a scheme that is part of the program; raise InputError if there is none."""
    names = sorted(path.stem for path in SHIPPED.glob("*.toml"))
    if name not in names:
        raise InputError(f"no scheme {name!r} is part of tunneldb: {', '.join(names)}.{did_you_mean(name, names)}")
    return SHIPPED / f"{name}.toml"


def list_shipped() -> list[dict[str, Any]]:
    """Return name, version, results and source of the schemes that are part of the program, by name."""
    found = [read_toml(path, "a rating scheme") for path in sorted(SHIPPED.glob("*.toml"))]
    return [{key: scheme[key] for key in ("name", "version", "results", "source")} for scheme in found]


def read_scheme(path: Path) -> Scheme:
    """Read a rating scheme.

    Raises
    ------
    InputError
        If the file cannot be read, or a key is unknown, missing or wrong; with the key.
    """
    given = _Given(path, read_toml(path, "a rating scheme"))
    given.refuse_others(SCHEME_KEYS)
    results = given.texts("results")
    if len(set(results)) != len(results) or not 2 <= len(results) <= 20:
        given.refuse("results", "2 to 20 different texts, from the best to the worst")
    valid_from = given.values.get("valid_from")
    if valid_from is not None and (not isinstance(valid_from, dt.date) or isinstance(valid_from, dt.datetime)):
        given.refuse("valid_from", "a date without quotes, as 2026-01-31")
    share = given.values.get("min_inspected", MIN_INSPECTED)
    if not _is_number(share) or not 0.0 <= share <= 1.0:
        given.refuse("min_inspected", "a number from 0 to 1")
    rules = given.values.get("rule")
    if not isinstance(rules, list) or not rules or not all(isinstance(rule, dict) for rule in rules):
        given.refuse("rule", "the file needs a part [[rule]] for each rule")
    totals = given.values.get("totals")
    if totals is not None and not isinstance(totals, dict):
        given.refuse("totals", "a part [totals] with above or from = {RESULT = SUM, …}")
    return Scheme(
        given.text("name"), given.text("version"), given.text("source"), valid_from, results, float(share),
        tuple(_rule(_Given(path, rule, f"rule {n}: "), results, totals is not None) for n, rule in enumerate(rules, start=1)),
        None if totals is None else _totals(_Given(path, totals, "totals: "), results),
    )  # fmt: skip


def _rule(given: _Given, results: Sequence[str], summed: bool) -> Rule:
    """Return a rule: limits with results, limits with points (summed), or a matrix of two measures."""
    given.refuse_others(RULE_KEYS)
    text = given.text("text")
    if summed != ("points" in given.values):
        given.refuse("points", "all rules of a scheme with [totals] have points" if summed else "points need a part [totals]")
    if "by" in given.values:
        by = given.values["by"]
        if summed or not isinstance(by, dict):
            given.refuse("by", "{measure = …, above or from = […]}, in a scheme without [totals]")
        columns = _Given(given.path, by, f"{given.place}by: ")
        columns.refuse_others(AXIS_KEYS)
        axis, other = _axis(given), _axis(columns)
        return Rule(text, axis, _cells(given, results, len(axis.limits) + 1, len(other.limits) + 1), by=other)
    if "results" in given.values:
        given.refuse("results", "only a rule with by, a matrix, has results")
    if summed:
        axis = _axis(given)
        return Rule(text, axis, (), _numbers(given, "points", len(axis.limits)))
    inclusive, limits, reached = _limits_of_results(given, results)
    return Rule(text, Limits(_kinds(given), _measure(given), inclusive, limits), reached)


def _totals(given: _Given, results: Sequence[str]) -> Totals:
    given.refuse_others(("above", "from"))
    return Totals(*_limits_of_results(given, results))


def _axis(given: _Given) -> Limits:
    """Return a measure whose limits are a list."""
    key = _limit_key(given)
    limits = _numbers(given, key, None)
    if list(limits) != sorted(set(limits)):
        given.refuse(key, "each limit is greater than the one before it")
    return Limits(_kinds(given), _measure(given), key == "from", limits)


def _limits_of_results(given: _Given, results: Sequence[str]) -> tuple[bool, tuple[float, ...], tuple[str, ...]]:
    """Return limits that are a table {RESULT = LIMIT}: True if an equal value reaches them, the limits, their results."""
    key = _limit_key(given)
    limits = given.values[key]
    if not isinstance(limits, dict) or not limits or not all(_is_number(limit) for limit in limits.values()):
        given.refuse(key, "{RESULT = LIMIT, …} with a number for each result")
    for result in limits:
        if result not in results:
            given.refuse(key, f"{result!r} is none of the results {', '.join(results)}")
    ordered = sorted(limits.items(), key=lambda item: float(item[1]))
    if [results.index(result) for result, _ in ordered] != sorted({results.index(result) for result in limits}):
        given.refuse(key, "a worse result needs a higher limit")
    if len({limit for _, limit in ordered}) < len(ordered):
        given.refuse(key, "two results have the same limit")
    return key == "from", tuple(float(limit) for _, limit in ordered), tuple(result for result, _ in ordered)


def _limit_key(given: _Given) -> str:
    if ("above" in given.values) == ("from" in given.values):
        given.refuse("above", "there is either above, or from, whose limits count as reached")
    return "above" if "above" in given.values else "from"


def _measure(given: _Given) -> str:
    measure = given.text("measure")
    if measure not in MEASURES:
        given.refuse("measure", f"{measure!r} is none of {', '.join(MEASURES)}")
    return measure


def _kinds(given: _Given) -> tuple[str, ...]:
    return given.texts("kinds") if "kinds" in given.values else ()


def _numbers(given: _Given, key: str, count: int | None) -> tuple[float, ...]:
    """Return a list of 1 to 20 numbers, or of as many as are wanted."""
    values = given.values[key]
    if (
        not isinstance(values, list)
        or not all(_is_number(value) for value in values)
        or not (1 <= len(values) <= 20 if count is None else len(values) == count)
    ):
        given.refuse(key, f"a list of {'1 to 20' if count is None else count} numbers is needed")
    return tuple(float(value) for value in values)


def _cells(given: _Given, results: Sequence[str], rows: int, columns: int) -> tuple[str, ...]:
    """Return the results of a matrix, row by row."""
    cells = given.values.get("results")
    if (
        not isinstance(cells, list)
        or len(cells) != rows
        or not all(isinstance(row, list) and len(row) == columns and all(cell in results for cell in row) for row in cells)
    ):
        given.refuse("results", f"{rows} rows of {columns} results are needed, one more than there are limits")
    return tuple(cell for row in cells for cell in row)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


class _Given(TomlTable):
    """Table of a rating scheme."""

    def text(self, key: str) -> str:
        value = self.values.get(key)
        if not isinstance(value, str) or not value.strip() or len(value) > 500:
            self.refuse(key, "a text of at most 500 characters is needed")
        return value.strip()

    def texts(self, key: str) -> tuple[str, ...]:
        value = self.values.get(key)
        if not isinstance(value, list) or not value or not all(isinstance(one, str) and one.strip() for one in value):
            self.refuse(key, "a list of texts is needed")
        return tuple(one.strip() for one in value)
