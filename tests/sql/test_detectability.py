"""Detectability in SQL: shares and the sentence of the blocks of the example, by counting them."""

from __future__ import annotations

import psycopg
import pytest
from support.example_survey import NAME

STATEMENT = "SELECT tunnel_internal.detectability_statement(id, %s, %s) FROM tunnel.survey"
SHARES = "SELECT met_share, not_met_share, unknown_share, lining_area FROM tunnel_api.detectability_shares(%s, %s, %s)"


def test_shares_are_those_of_the_blocks(conn: psycopg.Connection, example: str) -> None:
    """19 blocks along the tunnel by 5 around it: the first two do not meet the demand, one of 5 is unknown."""
    whole = conn.execute(SHARES, [NAME, "-Infinity", "Infinity"]).fetchall()
    assert whole == [pytest.approx((0.8 * 17 / 19, 0.8 * 2 / 19, 0.2, 19 * 5 * 30.0))]
    assert conn.execute(SHARES, [NAME, 12325, 12335]).fetchall() == [pytest.approx((0.4, 0.4, 0.2, 5 * 30.0))]
    assert conn.execute(SHARES, [NAME, 13000, 14000]).fetchall() == []


def test_the_statement_names_shares_and_stretches(conn: psycopg.Connection, example: str) -> None:
    assert conn.execute(STATEMENT, [12000, 13000]).fetchone() == (
        "leaks of 0.3 m² and 3 dB would be found with less than 90 % probability on 8 % of the inspected lining"
        " (12+310–12+330), and on 20 % it is unknown",
    )
    assert conn.execute(STATEMENT, [12400, 12500]).fetchone() == (
        "it is unknown on 20 % of the inspected lining whether leaks of 0.3 m² and 3 dB would be found",
    )
    conn.execute("UPDATE tunnel.detectability SET probability = 0.95")
    assert conn.execute(STATEMENT, [12000, 13000]).fetchone() == (None,)
