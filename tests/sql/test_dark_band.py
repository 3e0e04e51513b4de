"""Dark bands that may be wet or dirty: what is stated of them, and by what an inspector decides them."""

from __future__ import annotations

import psycopg
import pytest
from psycopg.conninfo import make_conninfo

SURVEY = "demo-2024"
BANDS = [  # km, n, chainages, arcs, dB, m²
    (12, 0, 12350.0, 12400.0, -7.0, -6.6, 3.0, 18.0),
    (12, 1, 12400.0, 12420.0, -7.0, -6.6, 3.0, 7.2),
    (12, 2, 12360.0, 12380.0, 6.6, 7.0, 2.5, 8.0),
]
GAPS = "SELECT chainage_from, chainage_to, reason FROM tunnel_api.coverage_gaps('demo-2024', {}, {}) WHERE state = 'undecided'"
LEAK = "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES ('demo-2024', 'leak', %s) RETURNING id"


@pytest.fixture(scope="session")
def template(example_template: str, people: None) -> str:
    return example_template


@pytest.fixture
def banded(conn: psycopg.Connection) -> psycopg.Connection:
    with conn.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.dark_band (survey_id, km, n, chainage_from, chainage_to, arc_from, arc_to, darkening, area)"
            " SELECT id, %s, %s, %s, %s, %s, %s, %s, %s FROM tunnel.survey",
            BANDS,
        )
    conn.execute("UPDATE tunnel.coverage SET step = step")  # as detect does, which replaces both
    conn.commit()
    return conn


def test_bands_are_gaps_of_which_the_area_is_stated(banded: psycopg.Connection) -> None:
    assert banded.execute(GAPS.format(12300, 12500).encode()).fetchall() == [
        (12350.0, 12420.0, "dark bands along the tunnel, 33.2 m²: wet or dirty")
    ]
    part = 18.0 * 10 / 50 + 8.0 * 5 / 20
    assert banded.execute(GAPS.format(12375, 12385).encode()).fetchall() == [
        (12375.0, 12385.0, f"dark bands along the tunnel, {part:.1f} m²: wet or dirty")
    ]
    ((said,),) = banded.execute("SELECT tunnel_api.coverage_statement('demo-2024', 12340, 12500)").fetchall()
    assert said == "Searched, but undecided 12+350–12+420 (dark bands along the tunnel, 33.2 m²: wet or dirty)"


def test_the_class_is_stated_with_the_bands_and_without(banded: psycopg.Connection) -> None:
    stretch = "SELECT class, class_if_wet, undecided_area FROM tunnel_api.leak_statistics('demo-2024', {}, {})"
    dry = banded.execute(stretch.format(12350, 12390).encode()).fetchall()
    assert dry == [(1, 4, pytest.approx(18.0 * 40 / 50 + 8.0))]  # a patch of more than 0.3 m² leaves class 4
    assert banded.execute(stretch.format(12480, 12490).encode()).fetchall() == [(1, 1, 0.0)]
    whole = banded.execute(stretch.format(12300, 12500).encode()).fetchall()
    by_km = "SELECT class, class_if_wet, undecided_area FROM tunnel_api.km_waterproof"
    assert banded.execute(by_km.encode()).fetchall() == whole
    kept = banded.execute("SELECT class, class_if_wet, undecided_area FROM tunnel.waterproof").fetchall()
    assert kept == whole


def test_a_leak_drawn_over_a_band_decides_it(banded: psycopg.Connection, dsn: str) -> None:
    with psycopg.connect(make_conninfo(dsn, user="ines"), autocommit=True) as ines:
        half = "POLYGON((12400 -7,12409 -7,12409 -6.6,12400 -6.6,12400 -7))"
        ((first,),) = ines.execute(LEAK, [half]).fetchall()
        assert ines.execute("SELECT bool_or(decided) FROM tunnel_api.dark_band").fetchone() == (False,)  # 45 % of one
        rest = "POLYGON((12409 -7,12420 -7,12420 -6.6,12409 -6.6,12409 -7))"
        ines.execute(LEAK, [rest])
        assert ines.execute("SELECT array_agg(km) FROM tunnel_api.dark_band WHERE decided").fetchone() == ([12],)
        assert [row[:2] for row in ines.execute(GAPS.format(12300, 12500).encode())] == [(12350.0, 12400.0)]
        ines.execute("UPDATE tunnel_api.finding SET review = 'rejected' WHERE id = %s", [first])
        assert [row[:2] for row in ines.execute(GAPS.format(12300, 12500).encode())] == [(12350.0, 12400.0)]  # 55 % are left
