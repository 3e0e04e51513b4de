"""Of what was mistyped the nearest is asked for."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.stages.parameters import settings


@pytest.mark.parametrize(("typed", "meant"), [("leeks", "leaks"), ("simulate-strcture", "simulate-structure")])
def test_a_mistyped_verb(typed: str, meant: str) -> None:
    done = CliRunner().invoke(main, [typed])
    assert done.exit_code == 2
    assert f"No such command '{typed}'. Did you mean '{meant}'?" in done.output


def test_a_mistyped_parameter() -> None:
    with pytest.raises(UserError, match=r"Did you mean 'leak\.min_area'\?$"):
        settings(["leak.min_arae=1"])


def test_what_is_like_nothing_is_asked_for_nothing() -> None:
    assert "Did you mean" not in CliRunner().invoke(main, ["qqqqq"]).output


def test_a_mistyped_survey_or_tunnel(example: str) -> None:
    for words, asked in (
        (["leaks", "demo-2042"], "there is no survey 'demo-2042'; the database has demo-2024. Did you mean 'demo-2024'?"),
        (["survey", "remove", "demo2024", "--yes"], "Did you mean 'demo-2024'?"),
        (["survey", "set", "dem-2024", "--date", "2024-05-05"], "Did you mean 'demo-2024'?"),
        (["report", "demo", "-o", "x.html"], "'demo' is a tunnel; say which of its surveys: demo-2024"),
        (["tunnel", "remove", "dmo"], "there is no tunnel 'dmo'; the database has demo. Did you mean 'demo'?"),
        (["profile", "list", "deom"], "Did you mean 'demo'?"),
        (["tunnel", "stationing", "demo-2024", "--show"], "'demo-2024' is a survey; its tunnel is 'demo'"),
    ):
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 2, words
        assert asked in done.output, words
