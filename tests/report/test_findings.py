"""Chapters on findings and dry regions, photos, the owner's template: against the database and the other documents."""

from __future__ import annotations

import base64
import hashlib
import html
import io
import json
import re
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import psycopg
import pypdf
import pytest
from click.testing import CliRunner, Result
from PIL import Image
from playwright.sync_api import sync_playwright
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.example_survey import NAME

from tunneldb.cli.main import main
from tunneldb.database import connect
from tunneldb.database.models.imported_image import KINDS as IMPORTED_KINDS
from tunneldb.errors import UserError
from tunneldb.export.tables.finding_counts import DARK, LEAKS, OTHERS, UNCOUNTED
from tunneldb.report import actions, findings
from tunneldb.report.change import CHANGE_WORDS
from tunneldb.report.owner import CHAPTERS, Owner, read_owner
from tunneldb.report.pictures import trouble
from tunneldb.report.pictures.load import Source
from tunneldb.report.words import english_texts, languages, plural_forms, read_language
from tunneldb.store.actions import STATES, URGENCIES
from tunneldb.store.coverage import GAP_STATES
from tunneldb.store.dry_regions import read_dry_regions
from tunneldb.store.survey import get_survey

NONE = np.empty(0, np.int64)

DRAWN = """
    INSERT INTO tunnel_api.finding_unrolled (survey, kind, severity, width_mm, review, remark, geom) VALUES
    ('demo-2024', 'crack', 3, 2, 'confirmed', '<b>open</b>', 'LINESTRING(12350 1, 12353 1.5)'),
    ('demo-2024', 'crack', 1, NULL, 'rejected', 'a scratch', 'LINESTRING(12360 1, 12361 1.5)'),
    ('demo-2024', 'crack', 2, 1, 'open', NULL, 'LINESTRING(12398 -1, 12402 -1)'),
    ('demo-2024', 'missing_bolt', 4, NULL, 'confirmed', NULL, 'POINT(12360 -2)'),
    ('demo-2024', 'drip', 2, NULL, 'confirmed', NULL, 'POINT(12370 0.5)'),
    ('demo-2024', 'delamination', NULL, NULL, 'open', 'hollow', 'POLYGON((12380 0, 12382 0, 12382 1, 12380 1, 12380 0))'),
    ('demo-2024', 'leak', 2, NULL, 'confirmed', NULL, 'POLYGON((12390 0, 12391 0, 12391 1, 12390 1, 12390 0))'),
    ('demo-2024', 'leak', 2, NULL, 'confirmed', NULL, 'POLYGON((12391.5 0, 12392 0, 12392 1, 12391.5 1, 12391.5 0))');
    SELECT tunnel_api.finding_split(id, 'LINESTRING(12380.5 -1, 12380.5 2)')
      FROM tunnel_api.finding WHERE kind = 'delamination';
    SELECT tunnel_api.finding_merge(array_agg(id)) FROM tunnel_api.finding WHERE kind = 'leak' AND origin = 'drawn';
    UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.05) WHERE id = 5;
    INSERT INTO tunnel_api.region (survey_id, kind, reason, geom)
        SELECT id, 'dry', 'oil', ST_MakeEnvelope(12470, -1, 12472, 2, 0) FROM tunnel.survey;
"""
KINDS = ["leak", "drip", "crack", "delamination", "missing_bolt", "joint", "dark"]
"""Those that occur, in the order of the catalogue."""


def run(dsn: str, *arguments: object, code: int = 0) -> Result:
    result = CliRunner().invoke(main, ["--dsn", dsn, *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result


def image(size: tuple[int, int], form: str, **options: Any) -> bytes:
    data = io.BytesIO()
    Image.new("RGB", size, "#c04020").save(data, form, **options)
    return data.getvalue()


class Answer(BaseHTTPRequestHandler):
    """A web server that has one photo."""

    def do_GET(self) -> None:
        self.send_response(200 if self.path == "/1.jpg" else 404)
        self.end_headers()
        if self.path == "/1.jpg":
            self.wfile.write(image((1200, 900), "JPEG"))

    def log_message(self, *arguments: object) -> None: ...


@pytest.fixture(scope="module")
def web() -> Iterator[str]:
    with HTTPServer(("127.0.0.1", 0), Answer) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Photos: one that its camera held upright, one that is none."""
    folder = tmp_path_factory.mktemp("photos")
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned by a quarter
    (folder / "upright.jpg").write_bytes(image((1600, 1200), "JPEG", exif=exif))
    (folder / "broken.jpg").write_text("not a readable image")
    return folder


@pytest.fixture(scope="module")
def drawn(server_dsn: str, example_template: str, web: str) -> Iterator[str]:
    """DSN of a copy of the example with findings, photos and a dry region, which is only read."""
    database = sql.Identifier("tunneldb_findings")
    with psycopg.connect(server_dsn, autocommit=True) as admin:
        admin.execute(sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(database, sql.Identifier(example_template)))
        dsn = make_conninfo(server_dsn, dbname="tunneldb_findings")
        with connect(dsn) as conn:
            conn.execute(DRAWN)
            for path in ("upright.jpg", "gone.jpg", "broken.jpg", f"{web}/1.jpg", f"{web}/2.jpg"):
                conn.execute(
                    "INSERT INTO tunnel_api.finding_photo (finding_id, path, caption)"
                    " SELECT id, %s, 'of it' FROM tunnel_api.finding WHERE kind = 'crack' AND severity = 3",
                    [path],
                )
        yield dsn
        admin.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(database))


@pytest.fixture(scope="module")
def report(drawn: str, folder: Path, web: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "r.html"
    allowed = ("--photo-server", web.removeprefix("http://"))
    told = json.loads(run(drawn, "report", NAME, "-o", path, "--photos", folder, *allowed, "--json").stdout)
    assert [missing.rpartition("/")[2] for missing in told["missing_photos"]] == ["gone.jpg", "broken.jpg", "2.jpg"]
    return path


def section(text: str, name: str) -> str:
    (found,) = re.findall(rf'<section id="{name}".*?</section>', text, re.DOTALL)
    return found


def cells(row: str) -> list[str]:
    return [html.unescape(re.sub("<[^>]*>", "", cell)).strip() for cell in re.findall(r"<td.*?</td>", row, re.DOTALL)]


def table(text: str) -> list[list[str]]:
    return [cells(row) for row in re.findall(r"<tr(?: [^>]*)?>.*?</tr>", text, re.DOTALL) if "<td" in row]


def test_report_workbook_json_and_view_count_alike(drawn: str, report: Path, tmp_path: Path) -> None:
    with connect(drawn) as conn:
        view = conn.execute(
            "SELECT k.label, sum(c.confirmed)::int, sum(c.open)::int, sum(c.counted)::int, sum(c.area), sum(c.length),"
            " sum(c.rejected)::int, sum(c.gone)::int, sum(c.dry)::int, sum(c.same)::int, sum(c.merged)::int"
            " FROM tunnel_api.finding_count c JOIN tunnel_api.finding_kind k ON k.code = c.kind GROUP BY k.code, k.label"
            " ORDER BY min(k.position)"
        ).fetchall()
        patches, wet = conn.execute(
            "SELECT patches, wet_area FROM tunnel_api.leak_statistics(%s, '-Infinity', 'Infinity')", [NAME]
        ).fetchone()
    text = report.read_text("utf-8")
    overview = section(text, "findings")
    rows = table(overview.partition("By state")[2].partition("</table>")[0])
    sums = {row[0]: row for row in rows if row[0].startswith("All ")}
    kinds = [row for row in rows if row[0] not in sums]
    numbers = [[float(cell.replace("–", "0")) for cell in row[1:]] for row in kinds]
    assert [row[0] for row in kinds] == [row[0] for row in view]
    assert numbers == [[pytest.approx(value, abs=0.006) for value in row[1:]] for row in view]
    assert sum(row[3] for row in view[:2]) == patches == float(sums["All leaks"][3]), "leaks and drips, as in the statistics"
    assert sum(row[4] for row in view[:2]) == pytest.approx(wet)
    assert float(sums["All leaks"][4]) == pytest.approx(wet, abs=0.0006)
    assert float(sums["All other findings"][3]) == sum(row[3] for row in view[2:-2])
    assert float(sums["All joints and dry dark areas"][3]) == sum(row[3] for row in view[-2:])
    told = json.loads(run(drawn, "findings", NAME, "-o", tmp_path / "f.xlsx", "--json").stdout)
    assert [kind["kind"] for kind in told["kinds"]] == KINDS
    head, *rows = openpyxl.load_workbook(tmp_path / "f.xlsx")["Counts"].iter_rows(values_only=True)
    rows = [row for row in rows if row[1]]
    for row, kind, stated in zip(rows, told["kinds"], view, strict=True):
        of = dict(zip(head, row, strict=True))
        assert (kind["counted"], kind["area"], kind["length"]) == (stated[3], *map(pytest.approx, stated[4:6]))
        assert (of["Counted"], of["Area, m²"], of["Length, m"]) == (stated[3], *map(pytest.approx, stated[4:6]))
        assert [of[f"Not counted: {state}"] for state in UNCOUNTED] == list(stated[6:])
        assert sum(kind["origins"].values()) == sum(kind["severities"].values()) == stated[3]


def test_each_finding_has_a_row_or_is_in_a_line_that_says_so(drawn: str, report: Path) -> None:
    text = report.read_text("utf-8")
    with connect(drawn) as conn:
        for kind in KINDS:
            rows = conn.execute(
                "SELECT id, state, label, coalesce(severity_label, '–') FROM tunnel_api.finding WHERE kind = %s", [kind]
            ).fetchall()
            chapter = section(text, f"kind-{kind}")
            listed = {
                int(key): cells(row) for key, row in re.findall(r'<tr id="finding-(\d+)".*?>(.*?)</tr>', chapter, re.DOTALL)
            }
            without = sum(map(int, re.findall(r"Not listed here, [^:]*: (\d+)", chapter)))
            assert len(listed) + without == len(rows), kind
            order = re.findall(r'<span class="review \w+">([^,]*), (\d+)', chapter)
            states = {findings.STATE_WORDS[row[1]] for row in rows if row[0] in listed}
            assert {state for state, _ in order} == states
            assert sum(int(count) for _, count in order) == len(listed)
            for key, _, label, severity in rows:
                if key in listed:
                    assert (listed[key][0], listed[key][1], listed[key][7]) == (str(key), label, severity)
        (merged,) = conn.execute("SELECT id FROM tunnel_api.finding WHERE origin = 'merged'").fetchone()
        region, ids = conn.execute("SELECT id, leak_ids FROM tunnel_api.dry_region WHERE reason = 'oil'").fetchone()
    assert f"; merged into {merged}" in section(text, "kind-leak")
    assert "<b>open" not in section(text, "kind-crack"), "a remark is text"
    (row,) = [row for row in table(section(text, "dry")) if row[0] == str(region)]
    assert row[6:] == ["oil", f"1 ({0.785:.3f} m²): {ids[0]}"] or row[7].endswith(f": {ids[0]}")


def test_report_workbook_and_json_say_which_dry_region_waits_and_who_approved(
    example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    waiting, approved = (
        conn.execute(
            "INSERT INTO tunnel_api.region (survey_id, kind, reason, geom)"
            " SELECT id, 'dry', 'oil', ST_MakeEnvelope(%s, -4, %s, 4, 0) FROM tunnel.survey RETURNING id",
            [start, start + 16.0],
        ).fetchone()[0]
        for start in (12410.0, 12450.0)
    )
    conn.execute("SELECT tunnel_api.dry_region_approve(%s)", [approved])
    (operator,) = conn.execute("SELECT approved_by FROM tunnel_api.dry_region WHERE id = %s", [approved]).fetchone()
    conn.commit()
    dsn = conn.info.dsn
    run(dsn, "report", example, "-o", tmp_path / "r.html")
    rows = {row[0]: row for row in table(section((tmp_path / "r.html").read_text("utf-8"), "dry"))}
    assert rows[str(waiting)][7] == "none yet: pending approval by an operator"
    assert "approved by" not in rows[str(waiting)][5]
    assert f"; approved by {operator}, " in rows[str(approved)][5]
    told = json.loads(run(dsn, "findings", example, "-o", tmp_path / "f.xlsx", "--json").stdout)
    stated = {region["id"]: (region["pending_approval"], region["approved_by"]) for region in told["dry_regions"]}
    assert (stated[waiting], stated[approved]) == ((True, None), (False, operator))
    head, *cells = openpyxl.load_workbook(tmp_path / "f.xlsx")["Dry regions"].iter_rows(values_only=True)
    sheet = {row["No."]: row for row in (dict(zip(head, row, strict=True)) for row in cells)}
    assert (sheet[waiting]["Pending approval"], sheet[approved]["Approved by"]) == (True, operator)
    assert sheet[approved]["Approved, UTC"] is not None


def test_photos_are_small_and_upright_and_what_is_missing_is_a_line(report: Path, web: str) -> None:
    chapter = section(report.read_text("utf-8"), "kind-crack")
    sizes = [
        Image.open(io.BytesIO(base64.b64decode(data))).size
        for data in re.findall(r'<img src="data:image/jpeg;base64,([^"]+)" alt="of it">', chapter)
    ]
    assert sizes == [(360, 480), (480, 360)]
    assert re.findall(r'<p class="lost">(.*?)</p>', chapter) == [
        "Photo gone.jpg (of it): no such file",
        "Photo broken.jpg (of it): not a readable image",
        f"Photo {web}/2.jpg (of it): could not be fetched: the server does not have it",
    ]


def test_a_server_must_be_allowed_as_the_report_says(drawn: str, folder: Path, web: str, tmp_path: Path) -> None:
    """Without its option, a photo of an internal server is a line in the report; a word that is no server is refused."""
    path = tmp_path / "r.html"
    run(drawn, "report", NAME, "-o", path, "--photos", folder, "--from", "12+350", "--to", "12+360")
    text = path.read_text("utf-8")
    assert f"Photo {web}/1.jpg (of it): http:// is refused: use https:// or --photo-server" in text
    said = run(drawn, "report", NAME, "-o", path, "--photo-server", "http://a/b", code=2).stderr
    assert "--photo-server http://a/b: not a host or host:port" in said


def test_digest_tells_another_finding(drawn: str, tmp_path: Path) -> None:
    digests = []
    with connect(drawn) as conn:
        survey = get_survey(conn, NAME)
        for change in ("SELECT", "SELECT", "UPDATE tunnel_api.finding_unrolled SET severity = 4 WHERE severity = 3"):
            conn.execute(change)
            chapter = findings.read_findings_chapter(conn, survey, (0.0, 1e5), frozenset(), NONE, Source(tmp_path), table=True)
            digest = hashlib.sha256()
            findings.digest_findings(digest, chapter, [])
            digests.append(digest.hexdigest())
        conn.rollback()
    assert digests[0] == digests[1] != digests[2]


def test_digest_tells_another_dry_region_and_another_width(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    survey = get_survey(conn, example)
    digests = []
    for change in (
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, width_mm, geom)"
        " VALUES ('demo-2024', 'crack', 1, 'LINESTRING(12350 1, 12353 1.5)')",
        "UPDATE tunnel_api.finding_unrolled SET width_mm = 0.3 WHERE kind = 'crack'",
        "INSERT INTO tunnel_api.region (survey_id, kind, reason, geom)"
        " SELECT id, 'dry', 'oil', ST_MakeEnvelope(12410, -4, 12426, 4, 0) FROM tunnel.survey",
        "UPDATE tunnel_api.region SET reason = 'soot' WHERE reason = 'oil'",
        "SELECT tunnel_api.dry_region_approve(id) FROM tunnel_api.region WHERE reason = 'soot'",
    ):
        conn.execute(change)
        chapter = findings.read_findings_chapter(conn, survey, (0.0, 1e5), frozenset(), NONE, Source(tmp_path), table=True)
        digest = hashlib.sha256()
        findings.digest_findings(digest, chapter, read_dry_regions(conn, survey))
        digests.append(digest.hexdigest())
    assert len(set(digests)) == len(digests)


def test_of_too_many_the_gravest_have_rows(drawn: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(findings, "MAX_ROWS", 2)
    with connect(drawn) as conn:
        chapter = findings.read_findings_chapter(
            conn, get_survey(conn, NAME), (0.0, 1e5), frozenset(), NONE, Source(tmp_path), table=True
        )
    (cracks,) = [kind for kind in chapter.kinds if kind.count.kind == "crack"]
    assert [row.severity for _, rows in cracks.groups for row in rows] == [3, 2]
    assert len(cracks.beyond) == 1, "that of severity 1, rejected"


def test_a_strip_shows_what_reaches_into_it_as_far_as_it_does(drawn: str, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "r.html"
    run(drawn, "report", NAME, "-o", path, "--photos", folder)
    with connect(drawn) as conn:
        cracks = dict(
            conn.execute("SELECT severity, id FROM tunnel_api.finding WHERE kind = 'crack' AND origin = 'drawn'").fetchall()
        )
    strips = dict(re.findall(r'<figure class="strip" id="strip-(\d+)">(.*?)</figure>', path.read_text("utf-8"), re.DOTALL))
    shown = {}
    for start, strip in strips.items():
        width, clipped, beyond = re.findall(
            r'<clipPath.*?<rect width="([\d.]+)".*?<g clip-path=.*?>(.*?)</g>(.*)', strip, re.DOTALL
        )[0]
        assert "<path" not in re.sub(r"<g transform.*?</g>", "", beyond)
        assert all(0.0 <= float(x) <= float(width) for x in re.findall(r'class="finding.*?<text x="([-\d.]+)"', beyond))
        shown[int(start)] = {int(number) for number in re.findall(r'#finding-(\d+)"', clipped)}
    assert [start for start, numbers in shown.items() if cracks[3] in numbers] == [12350], "it begins there"
    assert [start for start, numbers in shown.items() if cracks[2] in numbers] == [12350, 12400], "it crosses the end"


TEMPLATE = """
language = "de"
client = "Bahn & Söhne"
project = "Prüfung"
logo = "logo.png"
chapters = ["findings", "leaks", "dry", "signatures"]
[severity_colours]
3 = "#123456"
[headings]
"Crack" = "Spalt"
"""


def test_an_owners_template(drawn: str, folder: Path, tmp_path: Path) -> None:
    (tmp_path / "logo.png").write_bytes(image((2000, 500), "PNG"))
    (tmp_path / "owner.toml").write_text(TEMPLATE, "utf-8")
    path = tmp_path / "r.html"
    run(drawn, "report", NAME, "-o", path, "--template", tmp_path / "owner.toml", "--photos", folder)
    text = path.read_text("utf-8")
    logo = base64.b64decode(re.findall(r'class="logo" src="data:image/png;base64,([^"]+)"', text)[0])
    assert Image.open(io.BytesIO(logo)).size == (640, 160)
    assert re.findall(r'<section id="(\w+)"(?! class="kind)', text) == ["findings", "leaks", "sheets", "dry", "signatures"]
    left_out = re.findall(r"in diesem Bericht nicht enthalten:(.*)</p>", text)[0]
    assert [name.strip() for name in left_out.split(",")] == [
        "Zusammenfassung", "Maßnahmen", "Erfasste Auskleidung", "Auskleidung", "Querschnitte", "Statistik", "Lichtraum",
        "Ringe", "Verfahren", "Prüfungen",
    ]  # fmt: skip
    for said in ("<h2>Spalt</h2>", "<dd>Bahn &amp; Söhne</dd>", "<h2>Unterschriften</h2>", "--severity: #123456", 'lang="de"'):
        assert said in text
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 360, "height": 740})
        troubles: list[str] = []
        page.on("console", lambda message: troubles.append(message.text))
        page.on("pageerror", lambda error: troubles.append(str(error)))
        page.goto(f"{path.as_uri()}#leak-3")
        assert page.locator("dialog header b").inner_text() == "Feuchtstelle 3"
        assert page.locator("dialog svg.view image").count() == 1, "pictures are there without the chapter on the lining"
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        words = " ".join(pypdf.PdfReader(io.BytesIO(page.pdf(prefer_css_page_size=True))).pages[0].extract_text().split())
        assert re.search(r"Seite 1 von \d+", words)
        assert troubles == []
        browser.close()


def test_the_first_page_says_scanner_and_intensity_in_the_owners_language(
    example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    conn.execute("UPDATE tunnel.survey SET platform = 'mobile', intensity_kind = 'amplitude', reference = 'measured'")
    conn.commit()
    (tmp_path / "owner.toml").write_text('language = "de"\nchapters = ["summary"]', "utf-8")
    run(conn.info.dsn, "report", example, "-o", tmp_path / "r.html", "--template", tmp_path / "owner.toml")
    text = section((tmp_path / "r.html").read_text("utf-8"), "summary")
    assert f"<dd>{example}, mobiler Scanner</dd>" in text
    assert "<dd>Amplitude, Entfernungskurve gemessen</dd>" in text


def test_a_report_without_tables_of_leaks_lists_them_by_kind(drawn: str, tmp_path: Path) -> None:
    (tmp_path / "owner.toml").write_text('language = "sl"\nchapters = ["findings"]', "utf-8")
    run(drawn, "report", NAME, "-o", tmp_path / "r.html", "--template", tmp_path / "owner.toml")
    chapter = section((tmp_path / "r.html").read_text("utf-8"), "kind-leak")
    with connect(drawn) as conn:
        confirmed = conn.execute("SELECT id FROM tunnel_api.leak WHERE review = 'confirmed' AND kind = 'leak'").fetchall()
    assert {f'<tr id="finding-{key}"' in chapter for (key,) in confirmed} == {True}
    assert "<h2>Zamakanje</h2>" in chapter


def test_settings_written_by_windows_are_read(tmp_path: Path) -> None:
    path = tmp_path / "owner.toml"
    path.write_text('client = "Straßen"\r\n', "utf-8-sig")
    assert read_owner(path).client == "Straßen"


RATED = '[[rating]]\nscheme = "a"\nelements = "b"\n'
"""A rating of a template."""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = ", "is not TOML"),
        ("klient = 1", "klient: there is no such key Did you mean 'client'?"),
        ("client = 5", "client: must be a text, not 5"),
        ('language = "xx"', "language: 'xx' is none of de, en, sl"), ('logo = "none.png"', "logo: no file"),
        ('logo = "owner.toml"', "not a readable image"), ('chapters = "leaks"', "chapters: must be a list"),
        ('chapters = ["leeks"]', "chapters: unknown chapter 'leeks'"), ("chapters = []", "chapters: must be a list"),
        ("chapters = [[1]]", "unknown chapter [1]"),
        ('chapters = ["leaks", "leaks"]', "'leaks' occurs 2 times"), ("headings = 1", "headings: must be a table"),
        ('[headings]\n"Leeks" = "x"', "headings.'Leeks': unknown heading"),
        ('[headings]\n"Leaks" = 1', "headings.'Leaks': must be a text, not 1"),
        ('[headings]\n"{count} leaks" = ["1", "{number}"]', "has other names in braces"),
        ('[headings]\n"{count} leaks" = "{count}"', "must be a list of 2 texts, the plural forms by 'n != 1', not '{count}'"),
        ('language = "sl"\n[headings]\n"{count} leaks" = ["a", "b"]', "must be a list of 4 texts, the plural forms by"),
        ('[headings]\n"{count} leaks" = ["{count}", 2]', "must be a text, not 2"),
        ('waterproofing = "RVS 13.03"', "waterproofing: there are no classes of 'RVS 13.03'; leave it out, or"),
        ('headline = "class"', "headline: 'class' is none of facts, rating, waterproofing, none"),
        ('headline = "rating"', "headline: 'rating' needs a table [rating] with scheme and elements"),
        ('headline = "waterproofing"', "headline: 'waterproofing' needs a standard: waterproofing = \"GB 50108-2008\""),
        ('headline_text = "{result}"', 'headline_text: needs headline = "rating"'),
        (f'headline = "rating"\nheadline_text = "Note"\n{RATED}', "headline_text: 'Note' must contain {result}"),
        (f'headline = "rating"\nheadline_text = "{{result}} {{x}}"\n{RATED}', "no other braces than {result}, {scheme}"),
        ("rating = 5", "rating: must be a table [rating] or several [[rating]], not 5"),
        ('[rating]\nelements = "rings"', "rating 1: scheme: is missing: the name of a scheme (tunneldb rating list)"),
        (f'{RATED}[[rating]]\nscheme = "a"', "rating 2: elements: is missing: the name of a division of the tunnel"),
        ('[rating]\nscheme = "a"\nset = "b"', "rating 1: set: there is no such key; there are scheme, version, elements"),
        ('[rating]\nscheme = "a"\nversion = 2026', "rating 1: version: must be a text, not 2026"),
        ('chapters = ["rating"]', "chapters: 'rating' needs a table [rating] with scheme and elements"),
        ('standard = "Ril 853"', "standard: there is no such key"),
        ('chapters = ["classes"]', "chapters: 'classes' needs a standard: waterproofing = \"GB 50108-2008\""),
        ('[headings]\n"Leaks" = "{"', "has other names in braces"),
        ('[severity_colours]\n5 = "#123456"', "severity_colours.5: severities are 1 to 4"),
        ('[severity_colours]\n1 = "red"', "severity_colours.1: must be a colour such as #b8371d, not 'red'"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_template_is_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "owner.toml"
    path.write_text(text, "utf-8")
    with pytest.raises(UserError) as error:
        read_owner(path)
    assert str(error.value).startswith(f"{path}: ")
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_template_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["report", NAME, "-o", str(tmp_path / "r.html"), "--template", str(tmp_path / "no.toml")])
    assert (done.exit_code, done.stderr) == (
        2,
        f"tunneldb: {tmp_path / 'no.toml'}: cannot be read: No such file or directory\n",
    )


def test_examples_of_templates_and_a_language_of_ones_own(tmp_path: Path) -> None:
    examples = sorted((Path(__file__).parents[2] / "docs" / "examples").glob("owner-*.toml"))
    assert len(examples) == 3
    for path in examples:
        assert read_owner(path) != Owner()
    (tmp_path / "fr.toml").write_text('date = "%d/%m/%Y"\n[texts]\n"Leaks" = "Fuites"\n', "utf-8")
    (tmp_path / "owner.toml").write_text('language = "fr.toml"', "utf-8")
    words = read_owner(tmp_path / "owner.toml").words
    assert (words.language, words("Leaks"), words("Cracks")) == ("fr", "Fuites", "Cracks")


@pytest.mark.parametrize("date", ["%Q%", "%d.%m.%Y %H", "100%", "%"])
def test_a_day_that_cannot_be_written_is_one_line(tmp_path: Path, date: str) -> None:
    (tmp_path / "fr.toml").write_text(f'date = "{date}"', "utf-8")
    (tmp_path / "owner.toml").write_text('language = "fr.toml"', "utf-8")
    with pytest.raises(UserError) as error:
        read_owner(tmp_path / "owner.toml")
    assert str(error.value).startswith(f"{tmp_path / 'fr.toml'}: date: ")
    assert "is no part of a day" in str(error.value)
    assert "\n" not in str(error.value)


def test_catalogues_have_each_text_that_a_report_says(example_catalogue: frozenset[str]) -> None:
    """And no other; with the same names in braces."""
    for code in languages():
        catalogue = read_language(code)
        texts, forms = catalogue["texts"], plural_forms(catalogue["plural"])
        assert set(texts) == example_catalogue, code
        for english, said in texts.items():
            assert isinstance(said, list) == isinstance(english_texts()[english], list), (code, english)
            assert isinstance(said, str) or len(said) == forms, (code, english)
            for form in said if isinstance(said, list) else [said]:
                names = set(re.findall(r"{\w+}", english)), set(re.findall(r"{\w+}", form))
                assert names[0] - names[1] <= {"{count}"} if isinstance(said, list) else names[0] == names[1], (code, english)
                assert names[1] <= names[0], (code, english)
    bare = re.compile(r"\{\w+\} ((dry|dark|wet|detected|confirmed|largest|smallest) )*[a-z]{2,}s\b")
    assert [text for text, said in english_texts().items() if isinstance(said, str) and bare.search(text)] == []
    assert all(isinstance(said, list) or english == said for english, said in english_texts().items())


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("en", ["0 leaks", "1 leak", "2 leaks", "5 leaks", "11 leaks", "101 leaks", "1\u202f102 leaks"]),
        ("de", [f"{n} Feuchtstelle{'n' * (n != '1')}" for n in ("0", "1", "2", "5", "11", "101", "1\u202f102")]),
        # CLDR: one 1, two 2, few 3 and 4, each of the last two digits
        ("sl", ["0 zamakanj", "1 zamakanje", "2 zamakanji", "5 zamakanj", "11 zamakanj", "101 zamakanje"]),
    ],
)
def test_counts_have_the_plural_forms_of_the_language(tmp_path: Path, code: str, said: list[str]) -> None:
    (tmp_path / "owner.toml").write_text(f'language = "{code}"', "utf-8")
    words = read_owner(tmp_path / "owner.toml").words
    assert [words.count("{count} leaks", count) for count in (0, 1, 2, 5, 11, 101, 1102)][: len(said)] == said


def test_a_language_of_ones_own_has_its_own_plural(tmp_path: Path) -> None:
    texts = '[texts]\n"{count} leaks" = ["{count} venue", "{count} venues"]'
    (tmp_path / "fr.toml").write_text(f'plural = "n > 1"\n{texts}', "utf-8")
    (tmp_path / "owner.toml").write_text('language = "fr.toml"', "utf-8")
    words = read_owner(tmp_path / "owner.toml").words
    assert [words.count("{count} leaks", count) for count in (0, 1, 2)] == ["0 venue", "1 venue", "2 venues"]
    assert [words.count("{count} edits", count) for count in (0, 1)] == ["0 edits", "1 edit"], "what it omits stays English"
    for plural in ("n; alert(1)", "n/0", "n > 1 ? 2 : 0"):
        (tmp_path / "fr.toml").write_text(f'plural = "{plural}"', "utf-8")
        with pytest.raises(UserError, match="is not a plural expression of gettext"):
            read_owner(tmp_path / "owner.toml")


@pytest.fixture
def example_catalogue() -> frozenset[str]:
    """Texts of templates and scripts, and those that are put together: states, origins, kinds, …"""
    package = Path(findings.__file__).parent
    texts = set(CHAPTERS.values()) | set(findings.STATE_WORDS.values()) | {"detected", "redrawn", "split", "merged"}
    texts |= {LEAKS, OTHERS, DARK, *STATES, *URGENCIES, *actions.FOLLOW_UP.values(), "same"}
    texts |= {"longitudinal", "transverse", "oblique"}
    texts |= set(GAP_STATES) | {"Not searched for leaks: {stretches}", "Searched, with gaps: {stretches}"}
    texts |= set(CHANGE_WORDS.values()) | {"Chainage", "Station", "o’clock", "m²", "Client", "Project"}
    texts |= {"Prepared by", "Checked by", "Accepted by", "Name", "Position", "Date", "Signature"}
    texts |= {*IMPORTED_KINDS, "coordinates", "frames", "similarity", "affine", "piecewise"}
    texts |= {value for name, value in vars(trouble).items() if name.isupper()}
    baseline = (Path(__file__).parents[2] / "migrations" / "baseline" / "finding.sql").read_text("utf-8")
    texts |= set(re.findall(r"^    \('\w+', '([^']+)', '{", baseline, re.MULTILINE))
    texts |= set(re.findall(r"^    \(\d, '(\w+)',", baseline, re.MULTILINE))
    for path in [*(package / "templates").rglob("*.*"), package / "strip.py", package / "rating.py", package / "gaps.py"]:
        text = path.read_text("utf-8")
        texts |= set(re.findall(r'(?<![\w.])(?:_|self\.words|words)(?:\.count)?\(\s*"([^"]+)"', text))
        if path.suffix == ".js":
            texts |= set(re.findall(r'\["([^"]+)", "\w+", (?:\(|kind|arc|review)', text))
    return frozenset(texts)
