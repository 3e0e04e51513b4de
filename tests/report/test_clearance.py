"""The report's chapter on clearance: it states what the views say, and says what was not measured and not seen."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from support.example_clearance import TIGHT

from tunneldb.cli.main import main
from tunneldb.report.clearance import MIN_PLACE_DISTANCE, PLACES, read_clearance
from tunneldb.store.survey import get_survey


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def numbers(path: str) -> np.ndarray:
    return np.array([float(value) for value in re.findall(r"-?[\d.]+", path)]).reshape(-1, 2)


def test_the_chapter(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    # 20 m without a track, and a metre in which nothing was seen that counts
    conn.execute("DELETE FROM tunnel.clearance_section WHERE chainage_from BETWEEN 12400 AND 12419")
    conn.execute(
        "UPDATE tunnel.clearance_section SET margin = NULL, margin_se = NULL, clock = NULL, class = NULL, seen_share = 0"
        " WHERE chainage_from = 12450"
    )
    conn.execute("UPDATE tunnel.clearance_section SET inside = 7 WHERE chainage_from = %s", [TIGHT])
    conn.commit()
    (one,) = read_clearance(conn, get_survey(conn, example), 12300.0, 12500.0)
    assert (one.gauge, one.track, one.length, one.measured) == ("example", "single", 200.0, 180.0)
    assert (one.metres_inside, one.metres_without) == (1, 1)
    assert one.seen_share == pytest.approx(0.9 * 179 / 180)
    assert one.tightest[0]["margin"] == -0.05
    assert len(one.tightest) == PLACES
    begins = sorted(row["chainage_from"] for row in one.tightest)
    assert min(np.diff(begins)) >= MIN_PLACE_DISTANCE
    assert [(row["class"], row["depth"]) for row in one.counted] == [("appendage", 0.05)]
    assert [(row["class"], row["depth"]) for row in one.others] == [("object", 0.5)]
    assert one.plot.unmeasured == [(500.0, 100.0)]
    assert one.plot.unseen == [(750.0, 5.0)]
    assert one.plot.zero == pytest.approx(120.0 * 0.2 / 0.25)
    below = numbers(one.plot.inside)
    assert below[below[:, 1] > one.plot.zero + 1e-6].tolist() == [[250.0, 120.0], [255.0, 120.0]]
    assert one.metre is not None
    box = [float(value) for value in one.metre.box.split()]
    assert box == [-3.0, -6.0, 6.0, 8.0]
    outline = numbers(one.metre.outline)
    assert (outline.min(axis=0).tolist(), outline.max(axis=0).tolist()) == ([-1.0, -4.0], [1.0, 0.0])

    page = tmp_path / "report.html"
    done = CliRunner().invoke(main, ["report", example, "-o", str(page)])
    assert done.exit_code == 0, done.output
    chapter = page.read_text("utf-8").split('<section id="clearance">')[1].split("</section>")[0]
    assert "Not measured: 20.0 m of 200.0 m" in chapter
    assert "Metres without any measured point that counts: 1." in chapter
    assert re.findall(r"<dd>([−\d.]+)", chapter) == ["−50", "1", "1", "1", "180.0", "10.5"]
    counted, others = chapter.split("<h4>Infringements</h4>")[1].split("Infringements that do not count: objects")
    assert ("Fixture" in counted, "Object" in counted) == (True, False)
    assert ("Fixture" in others, "Object" in others) == (False, True)


def test_an_owner_may_leave_it_out(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    page, owner = tmp_path / "report.html", tmp_path / "owner.toml"
    owner.write_text('language = "de"\nchapters = ["clearance"]', "utf-8")
    assert CliRunner().invoke(main, ["report", example, "-o", str(page), "--template", str(owner)]).exit_code == 0
    assert "<h2>Lichtraum</h2>" in page.read_text("utf-8")
    conn.execute("DELETE FROM tunnel.clearance_section")
    conn.commit()
    assert CliRunner().invoke(main, ["report", example, "-o", str(page)]).exit_code == 0
    assert 'href="#clearance"' not in page.read_text("utf-8")
