"""Limits of what inspectors take out of the totals by drawing, and reviews of findings that are redrawn."""

from __future__ import annotations

import psycopg
import pytest
from click.testing import CliRunner
from psycopg.conninfo import make_conninfo

from tunneldb.cli.main import main

SURVEY = "demo-2024"
INSPECTOR = pytest.mark.parametrize("person", ["ines"], indirect=True)
LARGE = "ST_MakeEnvelope(12395, -6.5, 12440, 7.5, 0)"  # 630 m², over five leaks


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def draw(person: psycopg.Connection, geom: str, review: str) -> int:
    row = person.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, review, geom)"
        f" VALUES ('{SURVEY}', 'leak', '{review}', {geom}) RETURNING id".encode()
    ).fetchone()
    assert row is not None
    return int(row[0])


def region(person: psycopg.Connection, chainage: float, area: float, reason: str | None = None) -> tuple[int, bool]:
    """Draw a dry region of 1 m along the tunnel; return its key, and True if it waits for an operator."""
    row = person.execute(
        "INSERT INTO tunnel_api.region (survey, kind, reason, geom) VALUES (%s, 'dry', %s, ST_MakeEnvelope(%s, -6, %s, %s, 0))"
        " RETURNING id, pending_approval",
        [SURVEY, reason, chainage, chainage + 1, area - 6],
    ).fetchone()
    assert row is not None
    return row


def states(person: psycopg.Connection) -> dict[int, str]:
    return dict(person.execute("SELECT id, state FROM tunnel_api.finding WHERE kind = 'leak'").fetchall())


@INSPECTOR
def test_a_large_rejected_drawing_hides_no_leak(person: psycopg.Connection, dsn: str) -> None:
    before = states(person)
    with pytest.raises(psycopg.errors.CheckViolation, match=r"ines in demo-2024 would be 630\.0 m², more than 50") as refused:
        draw(person, LARGE, "rejected")
    for change in ("review = 'rejected'", "kind = 'leak', review = 'rejected'"):
        key = draw(person, LARGE, "confirmed")
        with pytest.raises(psycopg.errors.CheckViolation, match="more than 50"):
            person.execute(f"UPDATE tunnel_api.finding SET {change} WHERE id = {key}".encode())
        person.execute(f"DELETE FROM tunnel_api.finding_map WHERE id = {key}".encode())
    key = draw(person, "ST_MakeEnvelope(12450, 0, 12451, 1, 0)", "rejected")
    with pytest.raises(psycopg.errors.CheckViolation, match="more than 50"):
        person.execute(f"UPDATE tunnel_api.finding_unrolled SET geom = {LARGE} WHERE id = {key}".encode())
    assert {finding: state for finding, state in states(person).items() if finding in before} == before
    # as the hint says
    assert "Draw a dry region and give a reason" in (refused.value.diag.message_hint or "")
    (waiting,) = person.execute(
        f"INSERT INTO tunnel_api.region (survey, kind, reason, geom) VALUES ('{SURVEY}', 'dry', 'soot', {LARGE})"
        " RETURNING id".encode()
    ).fetchone()  # type: ignore[misc]
    with psycopg.connect(make_conninfo(dsn, user="otto"), autocommit=True) as otto:
        assert otto.execute("SELECT tunnel_api.dry_region_approve(%s)", [waiting]).fetchone()[0] > 0  # type: ignore[index]
        draw(otto, LARGE, "rejected")


@INSPECTOR
def test_many_small_regions_are_one_large_one(person: psycopg.Connection, dsn: str) -> None:
    for number in range(4):
        assert region(person, 12460 + number, 12)[1] is False
    with pytest.raises(
        psycopg.errors.CheckViolation, match=r"with 48\.0 m² that ines took away before in demo-2024, is larger"
    ):
        region(person, 12464, 12)
    key, waits = region(person, 12464, 12, "soot")
    assert waits is True
    with pytest.raises(psycopg.errors.CheckViolation, match="would be 61"):  # with the region that waits
        draw(person, "ST_MakeEnvelope(12480, 0, 12481, 1, 0)", "rejected")
    with psycopg.connect(make_conninfo(dsn, user="otto"), autocommit=True) as otto:
        otto.execute("SELECT tunnel_api.dry_region_approve(%s)", [key])
    draw(person, "ST_MakeEnvelope(12480, 0, 12481, 1, 0)", "rejected")  # what an operator approved is no longer counted
    with psycopg.connect(make_conninfo(dsn, user="olga"), autocommit=True) as olga:
        assert region(olga, 12466, 12)[1] is False  # of another person


@INSPECTOR
def test_what_is_hidden_and_by_whom_is_stated(person: psycopg.Connection) -> None:
    (leak, area, x, y) = person.execute(
        "SELECT id, ST_Area(unrolled), ST_X(ST_Centroid(unrolled)), ST_Y(ST_Centroid(unrolled)) FROM tunnel_api.leak"
        " WHERE review = 'open' ORDER BY area LIMIT 1"
    ).fetchone()  # type: ignore[misc]
    key = draw(person, f"ST_Buffer(ST_MakePoint({x}, {y}), 2)", "rejected")
    assert states(person)[leak] == "same"
    said = f"1 leak is not counted ({area:.2f} m²), taken out by ines: rejected drawing {key} (12.5 m²)"
    (remark,) = person.execute("SELECT remark FROM tunnel_api.remark WHERE stage = 'review'").fetchone()  # type: ignore[misc]
    assert remark.partition(" (")[0] == "1 leak is not counted"
    assert remark.partition("), ")[2] == said.partition("), ")[2]
    for command in ("status", "leaks"):
        assert f"taken out by ines: rejected drawing {key}" in CliRunner().invoke(main, [command, SURVEY]).output


@INSPECTOR
def test_another_outline_by_somebody_else_is_open_again(person: psycopg.Connection, dsn: str) -> None:
    place = "SELECT review, reviewed_by, drawn_by FROM tunnel_api.leak WHERE id = %s"
    key = draw(person, "ST_MakeEnvelope(12450, 0, 12451, 1, 0)", "confirmed")
    with psycopg.connect(make_conninfo(dsn, user="olga"), autocommit=True) as olga:
        redraw = "UPDATE tunnel_api.leak_unrolled SET geom = ST_MakeEnvelope(12450, 0, 12450 + %s, 1, 0) WHERE id = %s"
        olga.execute(redraw, [1.1, key])
        assert olga.execute(place, [key]).fetchone() == ("confirmed", "ines", "olga")
        olga.execute(redraw, [1.19, key])
        assert olga.execute(place, [key]).fetchone() == ("confirmed", "ines", "olga")
        olga.execute(redraw, [1.3, key])  # a third more than what ines saw, in small steps
        assert olga.execute(place, [key]).fetchone() == ("open", None, "olga")
        assert olga.execute("SELECT tunnel_api.finding_undo(%s)", [key]).fetchone() == ("redrawn",)
        assert olga.execute(place, [key]).fetchone() == ("confirmed", "ines", "olga")
        olga.execute(redraw, [26, key])
        olga.execute("UPDATE tunnel_api.leak SET review = 'confirmed' WHERE id = %s", [key])
        assert olga.execute(place, [key]).fetchone() == ("confirmed", "olga", "olga")
        person.execute(redraw, [20, key])
        assert olga.execute(place, [key]).fetchone() == ("open", None, "ines")


@INSPECTOR
def test_a_merge_does_not_extend_a_confirmation_of_somebody_else(person: psycopg.Connection, dsn: str) -> None:
    small = draw(person, "ST_MakeEnvelope(12450, 0, 12451, 1, 0)", "confirmed")
    with psycopg.connect(make_conninfo(dsn, user="olga"), autocommit=True) as olga:
        large = draw(olga, "ST_MakeEnvelope(12451, 0, 12470, 1, 0)", "open")
        assert olga.execute("SELECT tunnel_api.finding_merge(%s)", [[small, large]]).fetchone() == (small,)
        place = "SELECT review, reviewed_by FROM tunnel_api.finding WHERE id = %s"
        assert olga.execute(place, [small]).fetchone() == ("open", None)
        olga.execute("SELECT tunnel_api.finding_undo(%s)", [small])
        assert olga.execute(place, [small]).fetchone() == ("confirmed", "ines")
