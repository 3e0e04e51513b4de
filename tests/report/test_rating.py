"""Ratings, the headline and the last inspection in reports of the example survey."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

import openpyxl
import psycopg
import pytest
from click.testing import CliRunner, Result
from support.example_change import EARLIER
from support.example_inspection import SEARCHED_TO, add_inspection
from support.example_survey import NAME

from tunneldb.cli.main import main
from tunneldb.report import rating
from tunneldb.report.owner import Owner, RatingRequest, read_owner
from tunneldb.report.rating import Rating, level_colours, luminance, read_rating
from tunneldb.report.since import compare_results, read_since
from tunneldb.store.rating import compare_schemes, rate, rating_change
from tunneldb.store.survey import get_survey

WHOLE = (12300.0, 12500.0)
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
BLOCKS = '[[rating]]\nscheme = "example"\nelements = "blocks"\n'


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def run(*words: object, code: int = 0) -> Result:
    done = CliRunner().invoke(main, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == code, done.output
    return done


def report(folder: Path, owner: str, *words: str, code: int = 0) -> str:
    """Write a report with a template, and return its text; with another exit code, the error."""
    (folder / "owner.toml").write_text(owner, "utf-8")
    done = run("report", NAME, "-o", folder / "r.html", "--template", folder / "owner.toml", *words, code=code)
    if code:
        assert not (folder / "r.html").exists()
        return done.stderr.strip()
    return (folder / "r.html").read_text("utf-8")


def section(text: str, name: str) -> str:
    return text.partition(f'<section id="{name}">')[2].partition("</section>")[0]


def lead(text: str) -> list[str]:
    return [" ".join(html.unescape(one).split()) for one in re.findall(r'<p class="lead">(.*?)</p>', text, re.DOTALL)]


def read(
    conn: psycopg.Connection, survey: str = NAME, elements: str = "blocks", low: float = 12300, high: float = 12500
) -> Rating:
    return read_rating(conn, get_survey(conn, survey), low, high, 1, RatingRequest("example", None, elements))


def test_facts_are_the_default_headline(dsn: str, example: str, tmp_path: Path) -> None:
    """Leaks, wet area, inspected share and what could have been found; no standard, no rating."""
    text = report(tmp_path, 'client = "x"')
    verdict = text.partition('<div class="verdict')[2].partition('<dl class="figures">')[0]
    assert lead(verdict) == ["6 leaks on the inspected lining, wet area 13.38 m²."]
    assert "95.0 % of the lining was inspected" in verdict
    assert "Leaks of 0.30 m² and 3.0 dB would be found with at least 90 % probability on" in verdict
    assert 'class="grade' not in text
    assert "GB 50108" not in text
    assert 'id="rating"' not in text
    assert 'href="#rating"' not in text


def test_a_report_without_a_headline_still_has_the_facts(dsn: str, example: str, tmp_path: Path) -> None:
    text = report(tmp_path, 'headline = "none"')
    assert lead(text) == []
    assert '<div class="verdict' not in text
    assert text.index("95.0 % of the lining was inspected") < text.index('<dl class="figures">')


def test_a_class_may_be_stated_without_being_the_headline(dsn: str, example: str, tmp_path: Path) -> None:
    text = report(tmp_path, 'waterproofing = "GB 50108-2008"')
    assert lead(text) == ["6 leaks on the inspected lining, wet area 13.38 m²."]
    assert "GB 50108-2008" in section(text, "classes")


@pytest.mark.parametrize(
    ("language", "said"),
    [
        ("en", "Worst result by example 1: at least C"), ("de", "Schlechtestes Ergebnis nach example 1: mindestens C"),
        ("sl", "Najslabši rezultat po example 1: najmanj C"),
    ],
)  # fmt: skip
def test_the_worst_result_is_the_headline_where_the_owner_wants_it(
    dsn: str, example: str, tmp_path: Path, language: str, said: str
) -> None:
    """The first block was inspected in part only: the worst result is a lower bound, said before the numbers of results."""
    owner = f'language = "{language}"\nheadline = "rating"\n'
    text = report(tmp_path, owner + BLOCKS)
    assert lead(text) == [said]
    verdict = text.partition('<div class="verdict')[2].partition('<dl class="figures">')[0]
    count = {"en": "2 elements", "de": "2 Elemente", "sl": "2 elementa"}[language]
    assert verdict.index("95 %") < verdict.index(f">C</b> {count}</span>, ") < verdict.index(">B</b> 1 ")
    assert ">D</b>" not in verdict
    text = report(tmp_path, f'{owner}headline_text = "<Note> {{result}} ({{scheme}}/{{version}})"\n{BLOCKS}')
    bound = {"en": "at least", "de": "mindestens", "sl": "najmanj"}[language]
    assert lead(text) == [f"<Note> {bound} C (example/1)"]
    assert "<Note>" not in text


def test_all_texts_of_a_rating_are_in_the_language(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """A template in German or Slovenian leaves no English word of the chapter."""
    add_inspection(conn, example)
    conn.commit()
    english = r"Result|Elements|lower bound|not rated|Valid|Source|Since|Then|Now\b|worse|Why|Value|Limit\b|inspected"
    for language in ("de", "sl"):
        text = report(tmp_path, f'language = "{language}"\nheadline = "rating"\n{BLOCKS}')
        for part in (section(text, "rating"), text.partition('<h3 id="since">')[2].partition('<dl class="facts">')[0]):
            words = re.sub(r"<[^>]*>", " ", part)
            assert part
            assert re.findall(english, words) == [], language


def test_elements_that_were_not_inspected_are_not_rated_and_said_first(
    dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    conn.execute(
        "UPDATE tunnel.coverage SET seen = (SELECT array_agg(CASE WHEN km * 1000 + step * n < 12400.01 THEN 0 ELSE s END"
        " ORDER BY n) FROM unnest(seen) WITH ORDINALITY AS u (s, n))"
    )
    conn.commit()
    text = report(tmp_path, f'headline = "rating"\n{BLOCKS}')
    chapter = section(text, "rating")
    named = "Not rated, because nothing was inspected: 2 elements (block 1, block 2)."
    assert named in chapter
    assert chapter.index(named) < chapter.index('<table class="plain results">')
    assert re.search(r"<td>not rated</td><td class=\"n\">2</td>", chapter)
    assert chapter.count('class="level-0"') == 1, "both in one bar"


def test_a_stretch_has_the_elements_that_touch_it(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    text = report(tmp_path, BLOCKS, "--from", "12+350", "--to", "12+410")
    chapter = section(text, "rating")
    assert re.findall(r"<tr><td>(block \d)</td>", chapter) == ["block 2", "block 3"]
    assert "An element across an end of the stretch is rated as a whole." in chapter
    assert "Elements outside of the stretch, not in this report: 2." in chapter
    assert "An element across" not in section(report(tmp_path, BLOCKS), "rating")
    known = {row["name"]: row for row in rate(conn, NAME, "blocks", "example", None)}
    for row in read(conn, low=12350, high=12410).rows:
        assert row.items() >= known[row["name"]].items()


def test_findings_link_to_their_place_in_the_report(dsn: str, example: str, tmp_path: Path) -> None:
    """A leak outside of the stretch, or in a report without the chapter on leaks, has a number without a link."""
    text = report(tmp_path, BLOCKS)
    assert set(re.findall(r'<a href="#leak-(\d+)">\d+</a></td></tr>', section(text, "rating"))) == {"2", "3", "7"}
    text = report(tmp_path, 'chapters = ["summary", "rating"]\n' + BLOCKS)
    assert "#leak-" not in section(text, "rating")


def test_several_schemes_stand_side_by_side(dsn: str, example: str, tmp_path: Path) -> None:
    run("rating", "add", EXAMPLES / "rating-example.toml")
    both = f'{BLOCKS}version = "1"\n[[rating]]\nscheme = "example"\nelements = "zones"\n'
    chapter = section(report(tmp_path, both), "rating")
    assert re.findall(r'<h3 id="rating-\d">(.*?)</h3>', chapter) == ["example 1", "example 2026-1"], "the one added last"
    assert "valid from 1 January 2024" in chapter
    assert "example of the tests" in chapter
    assert len(re.findall("o’clock</text>", chapter)) == 4


def test_schemes_over_the_same_elements_say_where_they_differ(
    dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    """As the command that compares schemes does, the greatest difference first, with both results and why."""
    run("rating", "add", EXAMPLES / "rating-example.toml")
    both = BLOCKS + BLOCKS + 'version = "1"\n'
    part = section(report(tmp_path, both), "rating").partition("Where the schemes differ: blocks")[2]
    rows = compare_schemes(conn, NAME, "blocks", ("example", "2026-1"), ("example", "1"))
    known = sorted((row for row in rows if row["difference"]), key=lambda row: -round(abs(row["difference"]), 9))
    assert len(known) == 3
    assert re.findall(r"<tr><td>(block \d)</td>", part) == [row["name"] for row in known]
    assert "of its scheme: 3." in part
    assert "share of wet lining: 0.09472 % (0.05 %)" in part
    assert "Largest leak: 0.851 m² (0.5 m²)" in part
    again = section(report(tmp_path, BLOCKS + BLOCKS), "rating")
    assert "No element has a different place of the result between the best and the worst of its scheme." in again


def test_sums_of_points_and_matrices_say_all_that_decided(
    dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    """One value and its limit do not: the chapter has the sentence of SQL."""
    scheme_row = "INSERT INTO tunnel.rating_scheme (name, version, source, results, totals, total_results) VALUES"
    rule_row = "INSERT INTO tunnel.rating_rule (scheme_id, number, text, kinds, measure, inclusive, limits, results"
    conn.execute(f"{scheme_row} ('sums', '1', 'tests', '{{A,B,C}}', '{{2,5}}', '{{B,C}}')")
    conn.execute(
        f"{rule_row}, points) SELECT id, 1, 'area', '{{}}', 'area', true, '{{0.5}}', '{{}}', '{{3}}' FROM tunnel.rating_scheme"
        " WHERE name = 'sums'"
    )
    conn.execute(f"{scheme_row} ('matrix', '1', 'tests', '{{A,B,C}}', NULL, NULL)")
    conn.execute(
        f"{rule_row}, by_measure, by_kinds, by_inclusive, by_limits) SELECT id, 1, 'area by count', '{{}}', 'area', true,"
        " '{0.5}', '{A,A,B,C}', 'count', '{}', true, '{2}' FROM tunnel.rating_scheme WHERE name = 'matrix'"
    )
    conn.commit()
    for scheme in ("sums", "matrix"):
        chapter = section(report(tmp_path, BLOCKS.replace('"example"', f'"{scheme}"')), "rating")
        known = [row for row in rate(conn, NAME, "blocks", scheme, None) if row["rule"] is not None]
        assert {row["result"] for row in known} > {"B"} if scheme == "matrix" else {row["result"] for row in known} == {"B"}
        assert re.findall(r'<td class="why">([^–].*?)</td>', chapter) == [html.escape(row["why"]) for row in known]


def test_growth_that_is_not_known_makes_a_lower_bound(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    conn.execute("UPDATE tunnel.rating_rule SET measure = 'growth' WHERE measure = 'share'")
    conn.commit()
    chapter = section(report(tmp_path, BLOCKS), "rating")
    assert "because the inspected share is below 95 %: 1 element (block 1)." in chapter
    assert "because the growth since the earlier inspection is not known: 3 elements (block 2, block 3, block 4)." in chapter


@pytest.mark.parametrize(
    ("owner", "said"),
    [
        (BLOCKS.replace("example", "none"), "tunneldb: there is no rating scheme 'none': tunneldb rating list"),
        (f'{BLOCKS}version = "9"', "tunneldb: there is no rating scheme 'example 9': tunneldb rating list"),
        (
            BLOCKS.replace("blocks", "none"),
            "tunneldb: the tunnel of survey demo-2024 has no elements named none; tunneldb elements list shows them",
        ),
    ],
)
def test_what_does_not_exist_is_one_line(dsn: str, example: str, tmp_path: Path, owner: str, said: str) -> None:
    assert report(tmp_path, owner, code=2) == said


def test_another_scheme_has_another_digest(dsn: str, example: str, tmp_path: Path) -> None:
    digest = re.compile(r"digest (\w{16})<")
    plain, rated, again = (digest.findall(report(tmp_path, owner)) for owner in ("", BLOCKS, BLOCKS))
    assert rated == again != plain


def test_many_elements_are_folded_and_drawn_together(
    dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run("elements", "add", "demo", "metres", "--length", "1")
    monkeypatch.setattr(rating, "MAX_BARS", 50)
    text = report(tmp_path, BLOCKS.replace("blocks", "metres"))
    chapter = section(text, "rating")
    assert "<summary>All elements (200)</summary>" in chapter
    assert "A bar shows the worst result of the elements in it." in chapter
    (lane,) = read(conn, elements="metres").lanes
    assert [round(x) for x, _, level in lane.bars] == [0, *range(40, 1000, 20)], "that not rated is one"
    worst = {int((row["chainage_from"] - 12300) // 4): 0 for row in read(conn, elements="metres").rows}
    for row in read(conn, elements="metres").rows:
        place = int((row["chainage_from"] - 12300) // 4)
        worst[place] = max(worst[place], row["level"] or 0)
    assert {round(x / 20): level for x, _, level in lane.bars if x} == {n: level for n, level in worst.items() if n >= 2}


def test_colours_differ_and_letters_are_legible() -> None:
    for count in range(1, 12):
        colours = level_colours(count)
        assert len({colour for colour, _ in colours}) == count
        for colour, letters in colours:
            dark, light = sorted(luminance(one) for one in (colour, letters))
            assert (light + 0.05) / (dark + 0.05) > 4.5


@pytest.mark.parametrize(
    ("old", "new", "state"),
    [
        ((1, True), (3, True), "worse"), ((1, True), (3, False), "worse"), ((1, False), (3, True), "undecided"),
        ((3, True), (1, True), "better"), ((3, False), (1, True), "better"), ((3, True), (1, False), "undecided"),
        ((2, True), (2, True), "same"), ((2, False), (2, True), "undecided"), ((None, False), (2, True), "undecided"),
        ((2, True), (None, False), "undecided"),
    ],
)  # fmt: skip
def test_what_was_not_inspected_is_neither_worse_nor_better(
    old: tuple[int | None, bool], new: tuple[int | None, bool], state: str
) -> None:
    rows = [{"level": level, "complete": complete} for level, complete in (old, new)]
    assert compare_results(rows[0], rows[1]) == state


def test_the_last_inspection_is_compared(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    add_inspection(conn, example)
    survey = get_survey(conn, example)
    found = read_since(conn, survey, *WHOLE, [read(conn)])
    assert found is not None
    assert (found.old.name, found.then["patches"]) == (EARLIER, 2)
    assert found.then["seen_share"] == pytest.approx((SEARCHED_TO - 12310) / 200)
    assert found.change is not None
    assert found.change["leaks"] == {"grown": 1, "new": 1, "dry": 1, "same": 1}
    (pair,) = found.ratings
    then = {row["name"]: row for row in rate(conn, EARLIER, "blocks", "example", None)}
    now = {row["name"]: row for row in rate(conn, example, "blocks", "example", None)}
    assert [count for _, _, count, _ in pair.counts] == [sum(r["result"] == x for r in then.values()) for x in "ABCD"]
    assert [count for _, _, _, count in pair.counts] == [sum(r["result"] == x for r in now.values()) for x in "ABCD"]
    assert then["block 4"]["result"] is None, "not inspected then"
    assert pair.states == {"worse": 1, "better": 0, "same": 1, "undecided": 2}
    assert [(old["name"], old["result"], new["result"]) for old, new in pair.worse] == [
        ("block 3", "A", "C"),
        ("block 1", "A", "C"),
    ]
    changes = {row["name"]: row for row in rating_change(conn, example, "blocks", "example", None)}
    assert {row["earlier_survey"] for row in changes.values()} == {EARLIER}
    for old, new in zip(pair.before, pair.now.rows, strict=True):
        level = None if old["level"] is None or new["level"] is None else new["level"] - old["level"]
        assert changes[new["name"]]["change"] == level
        assert changes[new["name"]]["known"] == (old["complete"] and new["complete"])
    conn.commit()
    text = report(tmp_path, BLOCKS)
    part = text.partition('<h3 id="since">')[2].partition('<dl class="facts">')[0]
    assert "new 1, grown 1, the same 1, dry again 1" in part
    assert "<tr><th>Leaks</th><td>2</td><td>6</td></tr>" in part
    assert "<tr><th>Lining inspected</th><td>70.0 %</td><td>95.0 %</td></tr>" in part
    assert "<tr><th>not rated</th><td>1</td><td>0</td></tr>" in part
    assert "1 worse, 0 better, 1 the same, 2 not known" in part
    assert ">at least A</b>" in part


def test_surveys_that_were_not_compared_have_totals_and_the_command(
    dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    earlier = add_inspection(conn, example)
    for table in ("change_section", "change_region", "leak_change"):
        conn.execute(f"DELETE FROM tunnel.{table} WHERE old_survey_id = %s", [earlier])  # type: ignore[arg-type]
    conn.commit()
    part = report(tmp_path, "").partition('<h3 id="since">')[2].partition('<dl class="facts">')[0]
    assert f"are not known: tunneldb compare {EARLIER} {NAME}" in part
    assert "<td>2</td><td>6</td>" in part
    assert "dry again" not in part


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE tunnel.survey SET date = '2024-05-04' WHERE name = 'demo-2022'",
        "UPDATE tunnel.survey SET date = '2025-05-04' WHERE name = 'demo-2022'",
        "DELETE FROM tunnel.coverage WHERE survey_id = (SELECT id FROM tunnel.survey WHERE name = 'demo-2022')",
        "UPDATE tunnel.survey SET intensity_kind = 'none', intensity_dimension = NULL, reference = 'none'"
        " WHERE name = 'demo-2022'",
    ],
)
def test_what_is_no_earlier_inspection_is_not_compared(dsn: str, example: str, conn: psycopg.Connection, change: str) -> None:
    """A survey of the same day or later, or without a search for leaks."""
    add_inspection(conn, example)
    conn.execute(change)  # type: ignore[arg-type]
    assert read_since(conn, get_survey(conn, example), *WHOLE, []) is None


def test_a_copy_from_an_archive_is_no_inspection(dsn: str, example: str, conn: psycopg.Connection) -> None:
    earlier = add_inspection(conn, example)
    conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference)"
        " SELECT tunnel_id, 'original', date, intensity_dimension, intensity_kind, platform, reference FROM tunnel.survey"
        " WHERE id = %s",
        [earlier],
    )
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, parameters, started_at, finished_at, outcome)"
        " VALUES (%s, NULL, 'import', '{\"survey\": \"original\"}', now(), now(), 'done')",
        [earlier],
    )
    assert read_since(conn, get_survey(conn, example), *WHOLE, []) is None, "demo-2022 is a copy; the original was not searched"


def test_the_german_example_writes_a_report(dsn: str, example: str, tmp_path: Path) -> None:
    run("rating", "add", EXAMPLES / "rating-example.toml")
    run("elements", "add", "demo", "abschnitte", "--length", "10")
    path = EXAMPLES / "owner-rating-de.toml"
    assert read_owner(path).ratings == (RatingRequest("example", None, "abschnitte"),)
    assert Owner().headline == "facts"
    run("report", NAME, "-o", tmp_path / "r.html", "--template", path)
    text = (tmp_path / "r.html").read_text("utf-8")
    assert lead(text) == ["Zustandsnote des Tunnels mindestens 3 (example, Fassung 2026-1)"]


def test_a_workbook_of_findings_has_the_rating(dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    path = tmp_path / "f.xlsx"
    words = ("findings", "list", NAME, "--from", "12+350", "--to", "12+410")
    run(*words, "-o", path, "--scheme", "example", "--elements", "blocks", "--json")
    book = openpyxl.load_workbook(path)
    known = rate(conn, NAME, "blocks", "example", None)[1:3]
    rows = list(book["Rating"].iter_rows(min_row=2, values_only=True))
    assert [(row[1], row[6]) for row in rows] == [(row["name"], row["result"]) for row in known]
    assert [row[1] for row in book["Elements"].iter_rows(min_row=2, values_only=True)] == ["block 2", "block 3"]
    for wrong in (("--scheme", "example"), ("--scheme", "example", "--elements", "blocks", "--format", "csv")):
        assert "go together, and need a workbook" in run(*words, *wrong, code=2).stderr
    assert json.loads(run("rating", "apply", NAME, "--elements", "blocks", "--scheme", "example", "--json").stdout)["ok"]
