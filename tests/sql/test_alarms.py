"""Alarms: values against the series and closed formulas, and no all-clear for what was not inspected."""

from __future__ import annotations

from typing import Any

import psycopg
import pytest
from psycopg.rows import dict_row
from support.example_alarm import OVALITY, STEP
from support.example_change import LATER, OVALER, SECTION, UNSEEN, add_change, add_earlier
from support.example_rings import COUNT, LENGTH
from support.example_rings import OVALITY as RING_OVALITY
from support.example_survey import NAME, add_later_survey

YEARS = 731 / 365.25
"""From 2022-05-04 to 2024-05-04."""


def ask(conn: psycopg.Connection, query: str, values: Any = ()) -> list[dict[str, Any]]:
    return conn.cursor(row_factory=dict_row).execute(query, values).fetchall()


def alarms(conn: psycopg.Connection, name: str) -> list[dict[str, Any]]:
    return ask(conn, "SELECT * FROM tunnel_api.alarms('demo') WHERE name = %s ORDER BY chainage_from", [name])


def grade(value: float | None, warning: float, alarm: float) -> str:
    return "unknown" if value is None else "alarm" if value >= alarm else "warning" if value >= warning else "ok"


def earlier_dry(conn: psycopg.Connection) -> None:
    """Two years before, the same lining was inspected and was dry."""
    add_later_survey(conn, "demo-2022")
    conn.execute("UPDATE tunnel.survey SET date = '2022-05-04' WHERE name = 'demo-2022'")


def inspect_all(conn: psycopg.Connection) -> None:
    """Let the whole lining have been inspected; the first 10 m of the example were not."""
    conn.execute("UPDATE tunnel.coverage SET seen = lining")


def test_each_ring_has_its_ovality_and_level(conn: psycopg.Connection, example: str) -> None:
    """Ring n has n times the ovality of ring 1; the series of its chainage has the same number."""
    rows = alarms(conn, "oval")
    assert len(rows) == COUNT
    for number, row in enumerate(rows, start=1):
        assert (row["chainage_from"], row["chainage_to"]) == (12298 + LENGTH * number, 12300 + LENGTH * number)
        assert row["value"] == pytest.approx(number * RING_OVALITY)
        assert row["level"] == grade(row["value"], *OVALITY)
        (series,) = ask(conn, "SELECT * FROM tunnel_api.ring_series('demo', %s)", [row["chainage_from"] + LENGTH / 2])
        assert (row["value"], row["survey"], row["date"]) == (series["ovality"], series["survey"], series["date"])
    assert {row["level"] for row in rows} == {"ok", "warning", "alarm"}
    assert rows[49]["why"] == "ovality 0.005 reaches the warning 0.005"
    assert rows[89]["why"] == "ovality 0.009 reaches the alarm 0.009"
    assert rows[0]["why"] is None


def test_a_later_survey_is_judged_with_the_rate_since(conn: psycopg.Connection, example: str) -> None:
    """Each ring is more oval by half than two years before."""
    add_change(conn, NAME)
    for number, row in enumerate(alarms(conn, "oval"), start=1):
        assert (row["survey"], row["previous_survey"]) == (LATER, NAME)
        assert row["value"] == pytest.approx(OVALER * number * RING_OVALITY)
        assert row["previous_value"] == pytest.approx(number * RING_OVALITY)
        assert row["rate"] == pytest.approx((OVALER - 1) * number * RING_OVALITY * 365.25 / 730)


def test_a_ring_that_was_inspected_too_little_is_unknown_below_the_limits(conn: psycopg.Connection, example: str) -> None:
    """Three quarters of each ring were inspected: enough for 0.7, not for the default 0.95."""
    conn.execute("UPDATE tunnel.alarm_limit SET min_inspected = DEFAULT")
    for row in alarms(conn, "oval"):
        level = grade(row["value"], *OVALITY)
        assert row["level"] == ("unknown" if level == "ok" else level)
        assert row["why"].endswith("75 % inspected")


def test_rings_that_were_not_measured_are_unknown(conn: psycopg.Connection, example: str) -> None:
    """Rings 3 to 5 are gone, ring 7 has no ovality: one gap of 6 m, and one ring without a value."""
    conn.execute("DELETE FROM tunnel.ring WHERE number BETWEEN 3 AND 5")
    conn.execute("UPDATE tunnel.ring SET ovality = NULL WHERE number = 7")
    rows = [row for row in alarms(conn, "oval") if row["level"] == "unknown"]
    assert [(row["chainage_from"], row["chainage_to"], row["why"]) for row in rows] == [
        (12304, 12310, "no ring measured"),
        (12312, 12314, "ovality not measured"),
    ]
    conn.execute("DELETE FROM tunnel.ring")
    (row,) = alarms(conn, "oval")
    assert (row["chainage_from"], row["chainage_to"], row["level"]) == (12300, pytest.approx(12500, abs=0.5), "unknown")


def test_convergence_is_that_of_the_series(conn: psycopg.Connection, example: str) -> None:
    """Both ends of the chord moved inwards by 1 mm in sections with values there: 2 mm, a warning from 1.5 mm."""
    add_change(conn, NAME)
    conn.execute("UPDATE tunnel.change_section SET change = array_fill(0.001::real, ARRAY[200])")
    conn.execute("UPDATE tunnel.change_section SET change = array_fill('NaN'::real, ARRAY[200]) WHERE seen_both = 0")
    rows = alarms(conn, "chord")
    compared = [row for row in rows if row["chainage_to"] <= 12450]
    assert len(compared) == 100
    known = 0
    for row in compared:
        middle = row["chainage_from"] + SECTION / 2
        (series,) = ask(conn, "SELECT * FROM tunnel_api.convergence(%s, %s)", [NAME, middle])
        assert row["value"] == series["convergence"]
        if UNSEEN[0] <= row["chainage_from"] < UNSEEN[1]:
            assert (row["level"], row["value"]) == ("unknown", None)
            assert row["why"] == "an end of the chord was not inspected"
        else:
            known += 1
            assert row["value"] == pytest.approx(-0.002, rel=1e-5)
            assert row["level"] == "warning"
            assert (row["previous_survey"], row["previous_value"]) == (NAME, 0)
            assert row["rate"] == pytest.approx(-0.002 * 365.25 / 730, rel=1e-5)
    assert known == 94
    (rest,) = [row for row in rows if row["chainage_to"] > 12450]
    assert (rest["chainage_from"], rest["level"], rest["why"]) == (12450, "unknown", f"not compared with {NAME}")


def test_convergence_outwards_counts_as_inwards(conn: psycopg.Connection, example: str) -> None:
    add_change(conn, NAME)
    conn.execute("UPDATE tunnel.change_section SET change = array_fill(-0.0014::real, ARRAY[200])")
    rows = [row for row in alarms(conn, "chord") if row["chainage_to"] <= 12450]
    assert {row["level"] for row in rows} == {"alarm"}
    assert rows[0]["value"] == pytest.approx(0.0028, rel=1e-5)


def test_convergence_counts_since_the_earliest_reference(conn: psycopg.Connection, example: str) -> None:
    """The latest survey was compared with 2024 only: since 2022 its convergence is unknown, unless 2024 is the reference."""
    add_earlier(conn, NAME)
    add_change(conn, NAME)
    conn.execute("UPDATE tunnel.change_section SET change = array_fill(0.001::real, ARRAY[200])")
    assert {(row["level"], row["why"]) for row in alarms(conn, "chord")} == {("unknown", "not compared with demo-2022")}
    conn.execute("UPDATE tunnel.alarm_limit SET reference = %s WHERE name = 'chord'", [NAME])
    assert {row["level"] for row in alarms(conn, "chord") if row["chainage_to"] <= 12450} == {"warning"}
    conn.execute("UPDATE tunnel.alarm_limit SET reference = 'gone' WHERE name = 'chord'")
    assert {(row["level"], row["why"]) for row in alarms(conn, "chord")} == {("unknown", "the tunnel has no survey gone")}


def test_the_wet_area_of_a_stretch_is_that_of_the_statistics(conn: psycopg.Connection, example: str) -> None:
    rows = alarms(conn, "wet")
    assert [row["chainage_from"] for row in rows] == [12300 + STEP * n for n in range(4)]
    for row in rows:
        (known,) = ask(
            conn, "SELECT * FROM tunnel_api.leak_statistics(%s, %s, %s)", [NAME, row["chainage_from"], row["chainage_to"]]
        )
        assert row["value"] == pytest.approx(known["wet_area"])
        assert row["inspected_share"] == pytest.approx(known["seen_share"])
        assert row["level"] == grade(row["value"], 0.5, 1)
    assert [row["why"] for row in rows[:2]] == ["wet area 3.247822 m² reaches the alarm 1; 80 % inspected", None]


def test_leaks_are_cut_at_the_ends_of_stretches(conn: psycopg.Connection, example: str) -> None:
    """With stretches of 7 m some leaks are in two, each with its part; the sum is that of the whole."""
    conn.execute("UPDATE tunnel.alarm_limit SET step = 7 WHERE name = 'wet'")
    rows = alarms(conn, "wet")
    assert rows[0]["chainage_from"] == pytest.approx(12300)
    assert {round(row["chainage_from"] % 7, 6) for row in rows[1:]} == {0}
    (total,) = ask(conn, "SELECT tunnel_api.wet_area(%s, 12300, 12500) AS area", [NAME])
    assert sum(row["value"] for row in rows) == pytest.approx(total["area"])
    for row in rows:
        (part,) = ask(conn, "SELECT tunnel_api.wet_area(%s, %s, %s) AS area", [NAME, row["chainage_from"], row["chainage_to"]])
        assert row["value"] == pytest.approx(part["area"], abs=1e-9)


def test_what_was_not_inspected_is_unknown_unless_what_was_seen_reaches_a_limit(conn: psycopg.Connection, example: str) -> None:
    """10 of the first 50 m were not inspected: without its leaks the stretch is unknown, with them it is an alarm."""
    assert alarms(conn, "wet")[0]["level"] == "alarm"
    conn.execute("UPDATE tunnel.finding SET review = 'rejected'")
    rows = alarms(conn, "wet")
    assert [(row["value"], row["level"]) for row in rows] == [(0, "unknown"), (0, "ok"), (0, "ok"), (0, "ok")]
    assert rows[0]["why"] == "80 % inspected"
    conn.execute("DELETE FROM tunnel.coverage")
    assert {(row["value"], row["level"], row["why"]) for row in alarms(conn, "wet")} == {(None, "unknown", "not inspected")}


def test_the_part_of_a_stretch_beyond_the_survey_is_not_inspected(conn: psycopg.Connection, example: str) -> None:
    """The survey begins at 12+300: of a stretch from 12+200 only half was scanned, less what was not inspected."""
    conn.execute("UPDATE tunnel.tunnel SET start_chainage = 12200")
    conn.execute("UPDATE tunnel.alarm_limit SET step = 200 WHERE name = 'wet'")
    conn.execute("UPDATE tunnel.finding SET review = 'rejected'")
    rows = alarms(conn, "wet")
    assert [(row["chainage_from"], row["chainage_to"]) for row in rows] == [(12200, 12400), (12400, pytest.approx(12500))]
    assert rows[0]["inspected_share"] == pytest.approx(0.45)
    assert [row["level"] for row in rows] == ["unknown", "ok"]


def test_dark_bands_that_may_be_wet_are_no_all_clear(conn: psycopg.Connection, example: str) -> None:
    conn.execute("UPDATE tunnel.finding SET review = 'rejected'")
    conn.execute("INSERT INTO tunnel.dark_band SELECT id, 12, 0, 12360, 12400, -7, -6.6, 3, 20 FROM tunnel.survey")
    row = alarms(conn, "wet")[1]
    assert (row["value"], row["level"], row["why"]) == (0, "unknown", "has dark bands that may be wet")


def test_growth_is_wet_area_per_year_since_the_earlier_inspection(conn: psycopg.Connection, example: str) -> None:
    earlier_dry(conn)
    inspect_all(conn)
    wet = alarms(conn, "wet")
    for row, now in zip(alarms(conn, "growth"), wet, strict=True):
        assert row["previous_survey"] == "demo-2022"
        assert row["value"] == pytest.approx(now["value"] / YEARS)
        assert row["level"] == grade(row["value"], 0.25, 0.5)
        assert (now["previous_value"], now["rate"]) == (0, pytest.approx(now["value"] / YEARS))


def test_growth_is_unknown_without_an_earlier_inspection_of_the_place(conn: psycopg.Connection, example: str) -> None:
    inspect_all(conn)
    assert {(row["value"], row["level"], row["why"]) for row in alarms(conn, "growth")} == {
        (None, "unknown", "no earlier inspection")
    }
    earlier_dry(conn)
    conn.execute(
        "UPDATE tunnel.coverage c SET seen = (SELECT array_agg(CASE WHEN c.step * u.n > 410 THEN u.v ELSE 0 END ORDER BY u.n)"
        " FROM unnest(c.seen) WITH ORDINALITY AS u (v, n)) WHERE c.survey_id = tunnel_api.survey_id('demo-2022')"
    )
    rows = alarms(conn, "growth")
    assert [row["why"] for row in rows[:3]] == [f"{share} % inspected in demo-2022" for share in (0, 0, 80)]
    assert {row["level"] for row in rows[:3]} == {"unknown"}
    assert rows[3]["level"] == "warning"


def test_archive_copies_are_neither_the_latest_nor_the_earlier(conn: psycopg.Connection, example: str) -> None:
    """A copy of the survey has no leaks, and a later id; it is not judged."""
    before = ask(conn, "SELECT * FROM tunnel_api.alarms('demo')")
    add_later_survey(conn, "copy")
    conn.execute("UPDATE tunnel.survey SET date = '2024-05-04' WHERE name = 'copy'")
    assert alarms(conn, "wet")[0]["survey"] == "copy"
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, stage, parameters, versions, counts, started_at, finished_at, outcome)"
        " SELECT id, 'import', jsonb_build_object('survey', %s::text), '{}', '{}', now(), now(), 'done' FROM tunnel.survey"
        " WHERE name = 'copy'",
        [NAME],
    )
    assert ask(conn, "SELECT * FROM tunnel_api.alarms('demo')") == before


def test_a_new_survey_without_results_is_unknown(conn: psycopg.Connection, example: str) -> None:
    """The value of the survey before is named. It does not decide the level of the new survey."""
    conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
        " SELECT id, 'new', '2026-05-04', 'none', 'static' FROM tunnel.tunnel"
    )
    rows = ask(conn, "SELECT * FROM tunnel_api.alarms('demo')")
    assert {row["name"] for row in rows} == {"oval", "chord", "wet", "growth"}
    assert {(row["survey"], row["level"]) for row in rows} == {("new", "unknown")}
    assert [row["previous_value"] for row in rows if row["name"] == "wet"][1] == pytest.approx(0)
    conn.execute("DELETE FROM tunnel.survey")
    rows = ask(conn, "SELECT * FROM tunnel_api.alarms('demo')")
    assert [(row["level"], row["why"]) for row in rows] == [("unknown", "the tunnel has no survey")] * 4


def test_a_limit_applies_to_its_stretch_only(conn: psycopg.Connection, example: str) -> None:
    conn.execute("UPDATE tunnel.alarm_limit SET chainage_from = 12360, chainage_to = 12420")
    assert [(row["chainage_from"], row["chainage_to"]) for row in alarms(conn, "wet")] == [(12360, 12400), (12400, 12420)]
    rings = alarms(conn, "oval")
    assert (rings[0]["chainage_from"], rings[-1]["chainage_to"], len(rings)) == (12360, 12420, 30)
    conn.execute("UPDATE tunnel.alarm_limit SET chainage_from = 99000, chainage_to = 99100")
    rows = ask(conn, "SELECT * FROM tunnel_api.alarms('demo')")
    assert [(row["level"], row["why"]) for row in rows] == [("unknown", "the limit applies to no part of the tunnel")] * 4


@pytest.mark.parametrize(
    ("change", "constraint"),
    [
        ("warning = 0", "limits"),
        ("alarm = 0.001 WHERE name = 'oval'", "limits"),
        ("alarm = 'NaN'", "limits"),
        ("step = NULL WHERE name = 'wet'", "step"),
        ("step = 5 WHERE name = 'oval'", "step"),
        ("clock_to = 5 WHERE name = 'chord'", "clock"),
        ("clock_from = NULL WHERE name = 'chord'", "clock"),
        ("reference = 'demo-2024' WHERE name = 'wet'", "reference"),
        ("min_inspected = 1.1", "min_inspected"),
        ("chainage_from = 2, chainage_to = 1", "order"),
        ("quantity = 'speed'", "quantity"),
    ],
)
def test_limits_that_make_no_sense_are_refused(conn: psycopg.Connection, example: str, change: str, constraint: str) -> None:
    with pytest.raises(psycopg.errors.CheckViolation, match=f"alarm_limit_{constraint}_check"):
        conn.execute(f"UPDATE tunnel.alarm_limit SET {change}".encode())


@pytest.mark.parametrize("person", ["vera"], indirect=True)
def test_viewers_may_read(person: psycopg.Connection, conn: psycopg.Connection, example: str) -> None:
    assert len(person.execute("SELECT level FROM tunnel_api.alarms('demo') WHERE name = 'oval'").fetchall()) == COUNT
    assert len(person.execute("SELECT name FROM tunnel_api.alarm_limit").fetchall()) == 4
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("DELETE FROM tunnel.alarm_limit")


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_operators_may_write(person: psycopg.Connection, conn: psycopg.Connection, example: str) -> None:
    assert person.execute("UPDATE tunnel.alarm_limit SET alarm = 7").rowcount == 4


def test_a_wrong_tunnel_is_said(conn: psycopg.Connection, example: str) -> None:
    with pytest.raises(psycopg.Error, match="there is no tunnel nothing"):
        conn.execute("SELECT * FROM tunnel_api.alarms('nothing')")
