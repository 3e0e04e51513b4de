"""The statement on where leaks could be missed: in each language the stretches of SQL's own sentence."""

from __future__ import annotations

import re
from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner
from support.example_survey import NAME

from tunneldb.cli.main import main


def statement(folder: Path, language: str) -> str:
    """Return the statement of a report."""
    (folder / "owner.toml").write_text(f'language = "{language}"\n')
    path = folder / "report.html"
    result = CliRunner().invoke(main, ["report", NAME, "-o", str(path), "--template", str(folder / "owner.toml")])
    assert result.exit_code == 0, result.output
    found = re.search(r'<p class="warning" id="gaps">(.*?)</p>', path.read_text(), re.DOTALL)
    assert found is not None
    return " ".join(found.group(1).split())


@pytest.mark.parametrize(
    ("language", "said"),
    [
        ("en", "Searched, but unseen 12+300–12+310 (0 % of the lining inspected)."),
        ("de", "Durchsucht, mit Lücken: 12+300–12+310 (nicht erfasst, 0 % der Auskleidung erfasst)."),
        ("sl", "Preiskano, z vrzelmi: 12+300–12+310 (ni pregledano, pregledano 0 % obloge)."),
    ],
)
def test_each_language_names_the_gap(dsn: str, example: str, tmp_path: Path, language: str, said: str) -> None:
    assert statement(tmp_path, language) == said


def test_lining_that_was_not_searched_comes_first(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """The stretches are those of SQL's sentence, whatever the language."""
    conn.execute("DELETE FROM tunnel.coverage")
    conn.execute("DELETE FROM tunnel.run WHERE stage = 'detect'")
    conn.commit()
    english, german = statement(tmp_path, "en"), statement(tmp_path, "de")
    assert english.startswith("Not searched for leaks: ")
    assert german.startswith("Nicht nach Feuchtstellen durchsucht: ")
    assert re.findall(r"\d+\+\d+–\d+\+\d+", german) == re.findall(r"\d+\+\d+–\d+\+\d+", english) == ["12+300–12+500"]
