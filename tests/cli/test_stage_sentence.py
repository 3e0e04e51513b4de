"""What `run` says of stages."""

from __future__ import annotations

import psycopg
import pytest

from tunneldb.cli.stage_sentence import stage_sentence
from tunneldb.store.coverage import sum_leaks
from tunneldb.store.survey import get_survey

DETECTED = {"pixels": 9, "seen": 0.93351, "leaks": 1, "joints": 2, "dark": 1, "leaks_over_ends": 0, "leaks_gone": 3}


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.mark.parametrize(
    ("stage", "counts", "said"),
    [
        (
            "axis",
            {"iterations": 1, "moved": 0.00066, "measured": 1200, "interpolated": 2, "rejected": 2},
            "vertices: 1 200 measured, 2 interpolated between its neighbours; moved by at most 0.66 mm in the last of 1 pass",
        ),
        ("segments", {"segments": 1, "points": 117658}, "1 segment with 117 658 points"),
        (
            "sections",
            {"sections": 12, "classes_measured": 75, "classes_rejected": 20, "classes_interpolated": 5, "open": 3.5},
            "12 cross-sections, 75 % of their radii measured; no roof over 3.5 m",
        ),
        ("sections", {"sections": 0}, "0 cross-sections"),
        (
            "detect",
            DETECTED,
            "1 leak, 93.4 % of the lining inspected; dry dark areas: 2 joints and 1 other area; 3 not found again",
        ),
        (
            "detect",
            DETECTED | {"seen": 0.99997, "joints": 0, "dark": 0, "leaks_gone": 0},
            "1 leak, > 99.9 % of the lining inspected; dry dark areas: 0 joints and 0 other areas",
        ),
        ("detect", {"pixels": 1234, "leaks": 0}, "offset image of 1 234 pixels"),
    ],
)
def test_counts_become_a_sentence(stage: str, counts: dict[str, float], said: str) -> None:
    assert stage_sentence(stage, counts) == said


def test_every_leak_counts_once_and_none_that_was_rejected(conn: psycopg.Connection, example: str) -> None:
    survey = get_survey(conn, example)
    found = conn.execute(
        "SELECT count(*), sum(area) FROM tunnel_api.leak WHERE survey = %s AND review <> 'rejected'", [example]
    ).fetchone()
    assert found is not None
    count, area = sum_leaks(conn, survey)
    assert count == found[0]
    assert area == pytest.approx(found[1], rel=0.02)
