"""The chapter on actions: what the view lists, in three languages, in a stretch, with those of the earlier inspection."""

from __future__ import annotations

import html
import re
from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner
from support.example_survey import NAME, add_later_survey

from tunneldb.cli.main import main

LATER = "demo-2026"


def chapter(path: Path, *words: str) -> list[list[str]]:
    """Write a report; return the cells of the table of actions, without its head, and the warnings as a first row."""
    result = CliRunner().invoke(main, ["report", *words, "-o", str(path)])
    assert result.exit_code == 0, result.output
    found = re.search(r'<section id="actions">(.*?)</section>', path.read_text(), re.DOTALL)
    if found is None:
        return []
    rows = [_texts(row, "td") for row in re.findall(r"<tr>(.*?)</tr>", found.group(1), re.DOTALL)[1:]]
    return [_texts(found.group(1), "p"), *rows]


def _texts(part: str, tag: str) -> list[str]:
    """Return the texts of the elements of a kind."""
    inner = re.findall(rf"<{tag}\b[^>]*>(.*?)</{tag}>", part, re.DOTALL)
    return [" ".join(html.unescape(re.sub(r"<[^>]*>", " ", one)).split()) for one in inner]


@pytest.fixture
def acts(conn: psycopg.Connection, dsn: str, example: str) -> None:
    """Beside the action of the example: one that is overdue, one that is done."""
    insert = (
        "INSERT INTO tunnel_api.action (survey, chainage_from, chainage_to, measure, urgency, responsible, due, state) VALUES"
    )
    conn.execute(f"{insert} (%s, 12310, 12320, 'clean <the> drain', 'immediate', 'Works Ltd', '2020-03-31', 'ordered')", [NAME])
    conn.execute(f"{insert} (%s, 12450, 12460, 'repair', 'planned', NULL, '2020-03-31', 'done')", [NAME])
    conn.commit()


@pytest.mark.parametrize(
    ("language", "warning", "words"),
    [
        ("en", "Overdue actions: 1.", ("immediate", "ordered", "overdue", "not compared", "done")),
        ("de", "Überfällige Maßnahmen: 1.", ("sofort", "beauftragt", "überfällig", "nicht verglichen", "ausgeführt")),
        ("sl", "Zapadli ukrepi: 1.", ("takoj", "naročeno", "zapadlo", "ni primerjano", "izvedeno")),
    ],
)
def test_the_chapter_lists_the_actions(acts: None, tmp_path: Path, language: str, warning: str, words: tuple[str, ...]) -> None:
    (tmp_path / "owner.toml").write_text(f'language = "{language}"\n')
    said, first, second, third = chapter(tmp_path / "a.html", NAME, "--template", str(tmp_path / "owner.toml"))
    assert said[0] == warning
    assert first[3] == "clean <the> drain"
    assert (first[4], first[8], first[5]) == (words[0], words[1], "Works Ltd")
    assert first[6].endswith(words[2])
    assert (second[3], second[8]) == ("repair", words[4])
    assert third[3] == "seal the joint"
    assert (third[7].replace("\u202f", " "), third[9]) == ("1 200.00 EUR", words[3])


def test_a_stretch_has_its_own_actions(acts: None, tmp_path: Path) -> None:
    _, only = chapter(tmp_path / "a.html", NAME, "--from", "12+440", "--to", "12+470")
    assert only[3] == "repair"
    assert chapter(tmp_path / "b.html", NAME, "--from", "12+480", "--to", "12+490") == []


def test_the_next_inspection_states_what_became_of_the_list(acts: None, conn: psycopg.Connection, tmp_path: Path) -> None:
    """The report of the later survey has the actions of the earlier one, and whether the leak is dry now."""
    add_later_survey(conn)
    conn.execute(
        "INSERT INTO tunnel.leak_change (survey_id, old_survey_id, km, state, chainage_from, chainage_to, clock, area_old,"
        " area_old_se, area_new, area_new_se, seen_old, seen_new, old_kinds, new_kinds, old_ids, new_ids, unrolled, map,"
        " surface) SELECT tunnel_api.survey_id(%s), f.survey_id, 12, 'dry', f.chainage_from, f.chainage_to, 12, 1, 0, 0, 0, 1,"
        " 1, '{leak}', '{}', ARRAY[f.id], '{}', public.ST_Multi(f.unrolled), public.ST_Multi(f.map), public.ST_Multi(f.surface)"
        " FROM tunnel.finding f WHERE f.id = (SELECT finding_id FROM tunnel.action WHERE finding_id IS NOT NULL)",
        [LATER],
    )
    conn.commit()
    _, *rows = chapter(tmp_path / "a.html", LATER)
    (sealed,) = [row for row in rows if row[3] == "seal the joint"]
    assert sealed[9] == "dry since 2026-05-04"
    assert re.fullmatch(rf"\d+ \({NAME}\)", sealed[2])
    (tmp_path / "owner.toml").write_text('language = "de"\n')
    _, *rows = chapter(tmp_path / "b.html", LATER, "--template", str(tmp_path / "owner.toml"))
    assert "trocken seit 2026-05-04" in [row[9] for row in rows]


def test_without_actions_there_is_no_chapter(conn: psycopg.Connection, dsn: str, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.action")
    conn.commit()
    assert chapter(tmp_path / "a.html", NAME) == []
