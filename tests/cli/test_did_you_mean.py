"""Of what was mistyped the nearest is asked for."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main
from tunneldb.errors import UserError
from tunneldb.pipeline.parameters import settings


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
