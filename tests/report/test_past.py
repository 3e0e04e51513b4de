"""Reports of a survey as it was, and the verification of a report that was signed."""

from __future__ import annotations

import json
import re
import time
from datetime import UTC, datetime
from pathlib import Path

import psycopg
import pytest
from support.command import command
from support.example_survey import NAME

TEMPLATE = '[[rating]]\nscheme = "example"\nelements = "blocks"\n'


def body(path: Path) -> str:
    """Return a report without what names its moment."""
    text = re.sub(r'<script type="application/json" id="record">.*?</script>', "", path.read_text())
    text = re.sub(r"<p class=\"warning\">The survey as it was on [^<]*</p>", "", text)
    text = text.replace("Actions of earlier surveys are not included.", "")
    return " ".join(re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d(:\d\d)?", "TIME", text).split())


def edit(conn: psycopg.Connection) -> None:
    """Reject the largest leak, draw another, photograph one, and demand an action."""
    conn.execute(
        "UPDATE tunnel_api.finding SET review = 'rejected' WHERE id = (SELECT id FROM tunnel_api.finding WHERE counted AND wet"
        " ORDER BY area DESC LIMIT 1)"
    )
    conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES (%s, 'leak', ST_MakeEnvelope(12340, 1, 12342, 3))",
        [NAME],
    )
    conn.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (2, 'nothing.jpg')")
    conn.execute("INSERT INTO tunnel_api.action (survey, finding_id, measure) VALUES (%s, 2, 'seal')", [NAME])
    conn.commit()


@pytest.fixture
def signed(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> tuple[Path, datetime]:
    """A report before edits, and a moment between them."""
    (tmp_path / "owner.toml").write_text(TEMPLATE)
    path = tmp_path / "signed.html"
    command("report", NAME, "-o", path, "--template", tmp_path / "owner.toml")
    (moment,) = conn.execute("SELECT clock_timestamp()").fetchone()  # type: ignore[misc]
    conn.rollback()
    time.sleep(0.01)
    return path, moment


def test_a_report_as_of_a_moment_is_the_one_that_was_written_then(
    signed: tuple[Path, datetime], conn: psycopg.Connection, tmp_path: Path
) -> None:
    """After edits: every number, list, picture and record of edits is the same; the page says that it shows the past."""
    path, moment = signed
    edit(conn)
    now, then = tmp_path / "now.html", tmp_path / "then.html"
    command("report", NAME, "-o", now, "--template", tmp_path / "owner.toml")
    command("report", NAME, "-o", then, "--template", tmp_path / "owner.toml", "--as-of", moment.isoformat())
    assert body(now) != body(path)
    assert body(then) == body(path)
    assert "The survey as it was on" in then.read_text()
    stated = f"{moment.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
    assert f"as of {stated}" in then.read_text(), "the statement that is signed"
    assert "The survey as it was on" not in path.read_text()


def test_a_report_is_verified(signed: tuple[Path, datetime], conn: psycopg.Connection, tmp_path: Path) -> None:
    """Unchanged; changed since and genuine, with who edited what; the report of the past verifies as well."""
    path, moment = signed
    assert "unchanged" in command("report", "--verify", path).output
    edit(conn)
    result = command("report", "--verify", path, code=3)
    assert "the report states what the database had then" in result.output
    assert "changed since: 2 edits of finding by root" in result.output
    assert "changed since: 1 edit of action by root" in result.output
    said = json.loads(command("report", "--verify", path, "--json", code=3).stdout)
    assert (said["genuine"], said["unchanged"]) == (True, False)
    then = tmp_path / "then.html"
    command("report", NAME, "-o", then, "--as-of", moment.isoformat())
    command("report", "--verify", then, code=3)


def test_an_altered_database_or_file_is_found(signed: tuple[Path, datetime], conn: psycopg.Connection, tmp_path: Path) -> None:
    """A remark that was written past the views is in no audit."""
    path, _ = signed
    forged = tmp_path / "forged.html"
    text = path.read_text()
    (digest,) = re.findall(r'"digest": "(\w+)"', text)
    forged.write_text(text.replace(digest, "0" * 16))
    assert "not genuine" in command("report", "--verify", forged, code=4).output
    conn.execute("UPDATE tunnel.finding SET remark = 'dry' WHERE id = 1")
    conn.commit()
    assert "not genuine" in command("report", "--verify", path, code=4).output


def test_a_stage_that_ran_since_leaves_it_open(signed: tuple[Path, datetime], conn: psycopg.Connection, tmp_path: Path) -> None:
    path, moment = signed
    edit(conn)
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, outcome, finished_at)"
        " VALUES (tunnel_api.survey_id(%s), 12, 'detect', 'done', clock_timestamp())",
        [NAME],
    )
    conn.commit()
    assert "stage detect of km 12 ran on" in command("report", "--verify", path, code=5).output
    refused = command("report", NAME, "-o", tmp_path / "then.html", "--as-of", moment.isoformat(), code=2).output
    assert "take a later moment, or an archive of that time" in refused
    assert not (tmp_path / "then.html").exists()


def test_a_pdf_is_verified(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    path = tmp_path / "signed.pdf"
    command("report", NAME, "-o", path, "--from", "12+300", "--to", "12+350")
    assert "unchanged" in command("report", "--verify", path).output
    conn.execute("UPDATE tunnel_api.finding SET review = 'rejected' WHERE id = 1")
    conn.commit()
    command("report", "--verify", path, code=3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--verify", "{folder}/nothing.html"], "nothing.html"),
        (["--verify", "{folder}/text.html"], "is not a report by tunneldb report, or was changed"),
        (["--verify", "{folder}/text.html", NAME], "--verify FILE is given alone"),
        ([NAME], "--output FILE is missing"),
        (["-o", "{folder}/a.html"], "SURVEY is missing"),
        ([NAME, "-o", "{folder}/a.html", "--as-of", "yesterday"], "write a day as 2026-03-31"),
        ([NAME, "-o", "{folder}/a.html", "--as-of", "2999-01-01"], "is in the future"),
        ([NAME, "-o", "{folder}/a.html", "--as-of", "2001-01-01"], "was added after"),
    ],
)
def test_wrong_words_are_refused(dsn: str, example: str, tmp_path: Path, words: list[str], message: str) -> None:
    (tmp_path / "text.html").write_text("<p>digest")
    assert message in command("report", *(word.format(folder=tmp_path) for word in words), code=2).output


LISTS = (
    ["findings", NAME, "--state", "all"],
    ["leaks", NAME],
    ["leaks", NAME, "--by-km"],
    ["rating", "apply", NAME, "--elements", "blocks", "--scheme", "example"],
    ["actions", "list", "demo", "--survey", NAME],
)


@pytest.mark.parametrize("words", LISTS, ids=lambda words: " ".join(words[:2]))
def test_lists_as_of_a_moment(dsn: str, example: str, conn: psycopg.Connection, words: list[str]) -> None:
    """Each list after edits is the one of before."""
    before = command(*words).output
    (moment,) = conn.execute("SELECT clock_timestamp()").fetchone()  # type: ignore[misc]
    conn.rollback()
    edit(conn)
    assert command(*words).output != before
    then = command(*words, "--as-of", moment.isoformat()).output
    assert then == before
    assert "was added after" in command(*words, "--as-of", "2001-01-01", code=2).output
    assert conn.execute("SELECT count(*) FROM tunnel_api.audit WHERE at > %s", [moment]).fetchone() == (4,)


def test_actions_of_the_past_need_their_survey(dsn: str, example: str) -> None:
    assert "--as-of needs --survey" in command("actions", "list", "demo", "--as-of", "2026-01-01", code=2).output
