"""Elements and ratings by command: files, advice, an owner's scheme from end to end."""

from __future__ import annotations

import csv
import json
import re
import tomllib
from pathlib import Path

import psycopg
import pytest
from support.command import command, refused
from support.example_survey import NAME

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLE = DOCS / "examples" / "rating-example.toml"
PAGE_BLOCKS = re.findall(r"^```toml\n(.*?)^```$", (DOCS / "howto-rating.md").read_text("utf-8"), re.MULTILINE | re.DOTALL)
PAGE_SCHEMES = {tomllib.loads(block)["name"]: block for block in PAGE_BLOCKS if "[[rule]]" in block}
"""Schemes of the documentation, by name."""


def test_an_owners_scheme_from_end_to_end(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """Blocks of 50 m are added, rated by the scheme of the documentation, and written; each number is that of SQL."""
    command("rating", "add", str(EXAMPLE))
    command("elements", "add", "demo", "fifty", "--length", "50")
    path = tmp_path / "rating.csv"
    result = command(
        "rating", "apply", NAME, "--elements", "fifty", "--scheme", "example", "--version", "2026-1", "-o", str(path)
    )
    rows = list(csv.DictReader(path.open()))
    known = conn.execute(
        "SELECT name, result, complete, finding_id FROM tunnel_api.rating(%s, 'fifty', 'example', '2026-1')", [NAME]
    ).fetchall()
    assert [row["name"] for row in rows] == [row[0] for row in known] == ["12300", "12350", "12400", "12450"]
    assert [row["result"] for row in rows] == [row[1] or "" for row in known]
    assert "at least" in result.output, "the first 10 m were not inspected"
    words = ["--elements", "fifty", "--scheme", "example", "--version", "2026-1", "--json"]
    shown = json.loads(command("rating", "apply", NAME, *words).stdout)
    assert [one["result"] for one in shown["ratings"]] == [row[1] for row in known]


def rated_by_the_page(name: str, conn: psycopg.Connection, folder: Path) -> dict[str, dict[str, str]]:
    """Rate the blocks by a scheme of the page, with a crack of 0.6 mm and 3 m in block 2 and one of severity 3 in block 3."""
    path = folder / "scheme.toml"
    path.write_text(PAGE_SCHEMES[name])
    command("rating", "add", str(path))
    for severity, line in ((None, "LINESTRING(12355 0, 12358 0)"), (3, "LINESTRING(12408 0, 12409 0)")):
        conn.execute(
            "INSERT INTO tunnel_api.finding_unrolled (survey, kind, severity, width_mm, geom)"
            " VALUES (%s, 'crack', %s, 0.6, %s)",
            [NAME, severity, line],
        )
    conn.commit()
    written = folder / "rating.csv"
    command("rating", "apply", NAME, "--elements", "blocks", "--scheme", name, "-o", str(written))
    return {row["name"]: row for row in csv.DictReader(written.open())}


def test_the_page_has_schemes_and_a_template() -> None:
    assert list(PAGE_SCHEMES) == ["example", "matrix", "points"]
    assert tomllib.loads(PAGE_BLOCKS[-1])["rating"]["scheme"] in PAGE_SCHEMES
    given, page = tomllib.loads(EXAMPLE.read_text()), tomllib.loads(PAGE_SCHEMES["example"])
    rules = {rule["text"]: rule for rule in given["rule"]}
    assert all(rules[rule["text"]] | rule == rules[rule["text"]] for rule in page["rule"])
    assert {key: page[key] for key in page if key != "rule"} == {key: given[key] for key in given if key != "rule"}


def test_the_matrix_of_the_page(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """The crack of 3 m has row 3 and column 1, as the page says."""
    rows = rated_by_the_page("matrix", conn, tmp_path)
    assert [row["result"] for row in rows.values()] == ["0", "1", "1", "0"]
    assert rows["block 2"]["why"].startswith("Width and length of cracks: 0.6 and 0.00")
    shown = command("rating", "show", "matrix").output
    assert "width_mm ≥ 0.2, 0.5 × density_length > 0.01, 0.05: 0 0 1 | 0 1 2 | 1 2 3" in " ".join(shown.split())


def test_the_points_of_the_page(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """Block 3 has 3.8 m² of wet area and more, and severity 3; growth is unknown, and the remark says so."""
    rows = rated_by_the_page("points", conn, tmp_path)
    assert [row["result"] for row in rows.values()] == ["fair", "good", "poor", "good"]
    assert rows["block 3"]["why"].startswith("60 points: Wet area 40 (")
    assert rows["block 1"]["remark"] == "80 % inspected; growth unknown: no earlier inspection"
    assert {row["complete"] for row in rows.values()} == {"False"}
    shown = command("rating", "apply", NAME, "--elements", "blocks", "--scheme", "points").output
    assert "less than 95 % was inspected, now or in the earlier inspection (remark): 4 elements" in shown


def test_lists_and_removal(dsn: str, example: str, conn: psycopg.Connection) -> None:
    command("rating", "add", str(EXAMPLE))
    assert "2026-1" in command("rating", "list").output
    assert "≥ 0.2: 1; ≥ 0.5: 2; ≥ 2: 3" in command("rating", "show", "example", "2026-1").output
    assert "blocks" in command("elements", "list", "demo").output
    command("rating", "remove", "example", "2026-1")
    command("elements", "remove", "demo", "blocks")
    assert refused("rating", "show", "example", "2026-1").endswith("tunneldb rating list")
    assert refused("elements", "remove", "demo", "blocks").endswith("tunneldb elements list demo")


def test_a_version_is_never_changed(dsn: str, example: str) -> None:
    command("rating", "add", str(EXAMPLE))
    message = refused("rating", "add", str(EXAMPLE))
    assert "a version is never changed" in message
    assert "tunneldb rating remove example 2026-1" in message


def test_a_scheme_of_the_program_is_added_by_its_name(dsn: str, example: str) -> None:
    listed = json.loads(command("rating", "list", "--shipped", "--json").stdout)["schemes"]
    (scheme,) = [one for one in listed if one["name"] == "gb-50108-2008"]
    assert "https://" in scheme["source"]
    assert "gb-50108-2008 1: 4 rules, results 1, 2, 3, 4" in command("rating", "add", "--shipped", "gb-50108-2008").stderr
    assert scheme["source"] in command("rating", "show", "gb-50108-2008").output
    assert "≥ 1: 2" in command("rating", "show", "gb-50108-2008").output


def test_schemes_of_the_program_are_listed_without_a_server(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUNNELDB_DSN", "host=nowhere.invalid")
    assert "sia-272-2024" in command("rating", "list", "--shipped").output


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "give exactly one of FILE and --shipped NAME"),
        ([str(EXAMPLE), "--shipped", "gb-50108-2008"], "give exactly one of FILE and --shipped NAME"),
        (["--shipped", "gb-50108"], "no scheme 'gb-50108' is part of tunneldb: gb-50108-2008, "),
        (["--shipped", "../schemes/gb-50108-2008"], "no scheme '../schemes/gb-50108-2008' is part of tunneldb"),
    ],
)
def test_a_wrong_choice_of_a_scheme_is_refused(words: list[str], message: str) -> None:
    assert message in refused("rating", "add", *words)


def test_rings_and_zones_become_elements(dsn: str, example: str, conn: psycopg.Connection) -> None:
    command("elements", "add", "demo", "rings", "--rings", NAME, "--zones")
    rows = conn.execute(
        "SELECT name, chainage_from, chainage_to, clock_from, clock_to FROM tunnel_api.element WHERE element_set = 'rings'"
        " ORDER BY number"
    ).fetchall()
    assert rows[0] == ("ring 1 crown", 12300, 12302, 10, 2)
    assert len(rows) == 4 * 100


def test_blocks_between_joints_become_elements(dsn: str, example: str, conn: psycopg.Connection) -> None:
    """One joint spans 14 m of 24 m; three pieces make another one; those of 12 m (of the example) and 4 m bound no block."""
    pieces = (
        (12380, 12380.1, -9, -4), (12380.1, 12380.2, -4, 1), (12380, 12380.1, 2, 6), (12450, 12450.1, -8, 6),
        (12470, 12470.1, 0, 4),
    )  # fmt: skip
    for low, high, arc_from, arc_to in pieces:
        conn.execute(
            "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom)"
            " VALUES (%s, 'joint', public.ST_MakeEnvelope(%s, %s, %s, %s))",
            [NAME, low, arc_from, high, arc_to],
        )
    conn.commit()
    command("elements", "add", "demo", "between", "--joints", NAME)
    rows = conn.execute(
        "SELECT name, chainage_from, chainage_to FROM tunnel_api.element WHERE element_set = 'between' ORDER BY number"
    ).fetchall()
    assert [row[0] for row in rows] == ["block 1", "block 2", "block 3"]
    assert [row[1] for row in rows] == pytest.approx([12300, 12380.08, 12450.05], abs=0.05)
    assert rows[-1][2] == 12500
    conn.execute("UPDATE tunnel_api.finding SET review = 'rejected' WHERE kind = 'joint'")
    conn.commit()
    assert "has no joint around half" in refused("elements", "add", "demo", "none", "--joints", NAME)


def test_elements_of_a_file(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    path = tmp_path / "blocks.csv"
    path.write_text("name,chainage_from,chainage_to,clock_from,clock_to\nportal,12300,12310,0,12\nvault 1,12310,12330,9,3\n")
    refused("elements", "add", "demo", "own", "--file", str(path))  # 0 and 12 are one place
    path.write_text("name,chainage_from,chainage_to,clock_from,clock_to\nportal,12300,12310,6,5.9\nvault 1,12310,12330,9,3\n")
    command("elements", "add", "demo", "own", "--file", str(path))
    rows = conn.execute("SELECT name, clock_from FROM tunnel_api.element WHERE element_set = 'own' ORDER BY number").fetchall()
    assert rows == [("portal", 6), ("vault 1", 9)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,chainage_from,chainage_to\na,10,10\n", "line 2: chainage_to 10 is not greater than chainage_from 10"),
        ("name,chainage_from,chainage_to\n ,10,20\n", "line 2: the element has no name"),
        ("name,chainage_from,chainage_to,clock_from,clock_to\na,10,20,3,3\n", "line 2: clock_from 3 and clock_to 3 are two"),
        ("name,chainage_from,chainage_to,clock_from,clock_to\na,10,20,3,13\n", "line 2: clock_from 3 and clock_to 13 are two"),
        ("name,chainage_from,chainage_to\n", "has no row below its header"),
        ("chainage_from,chainage_to\n1,2\n", "name"),
    ],
)
def test_wrong_elements_are_refused_with_their_line(dsn: str, example: str, tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    assert message in refused("elements", "add", "demo", "own", "--file", str(path))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--length", "10", "--rings", NAME], "exactly one of --length M, --rings SURVEY, --joints SURVEY and --file FILE"),
        ([], "exactly one of --length M, --rings SURVEY, --joints SURVEY and --file FILE"),
        (["--rings", "nothing"], "no survey 'nothing'"),
    ],
)
def test_wrong_words_are_refused(dsn: str, example: str, words: list[str], message: str) -> None:
    assert message in refused("elements", "add", "demo", "own", *words)


GOOD = EXAMPLE.read_text()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('measure = "share"', 'measure = "part"', "rule 1: measure: 'part' is none of area, share, largest_area"),
        ('"3" = 0.01 }', '"3" = 0.0001 }', "rule 1: above: a worse result needs a higher limit"),
        ('"3" = 0.01 }', '"7" = 0.01 }', "rule 1: above: '7' is none of the results 0, 1, 2, 3, 4"),
        ('"3" = 0.01 }', '"3" = 0.002 }', "rule 1: above: two results have the same limit"),
        ('"3" = 0.01 }', '"3" = "x" }', "rule 1: above: {RESULT = LIMIT, …} with a number"),
        ('kinds = ["crack"]', 'kinds = ["crak"]', "rule 3: there is no kind of finding 'crak'"),
        ('kinds = ["crack"]', 'kinds = "crack"', "rule 3: kinds: a list of texts is needed"),
        ('version = "2026-1"', "version = 2026", "version: a text of at most 500 characters is needed"),
        ("valid_from = 2026-01-01", 'valid_from = "2026-01-01"', "valid_from: a date without quotes"),
        ("min_inspected = 0.95", "min_inspected = 95", "min_inspected: a number from 0 to 1"),
        ('results = ["0", "1", "2", "3", "4"]', 'results = ["0", "0"]', "results: 2 to 20 different texts"),
        ('source = "Example; no directive"', 'sauce = "x"', "sauce: there is no such key Did you mean 'source'?"),
        ('from = { "1" = 0.2', 'above = { "1" = 1 }\nfrom = { "1" = 0.2', "rule 3: above: there is either above, or from"),
        ("[[rule]]", "[[ruel]]", "ruel: there is no such key"),
        ("name = ", "name == ", "is not TOML"),
    ],
)
def test_wrong_schemes_are_refused_with_their_key(
    dsn: str, example: str, tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "scheme.toml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new, 1) if old != "[[rule]]" else GOOD.replace(old, new))
    said = refused("rating", "add", str(path))
    assert message in said
    assert str(path) in said or "there is no kind" in said


def test_rating_names_what_is_missing(dsn: str, example: str) -> None:
    assert "tunneldb rating list" in refused("rating", "apply", NAME, "--elements", "blocks", "--scheme", "nothing")
    assert "tunneldb elements list" in refused("rating", "apply", NAME, "--elements", "nothing", "--scheme", "example")
