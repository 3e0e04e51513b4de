"""Rated elements and actions in real QGIS: styles, labels, forms and edits."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pytest
import rasterio
from click.testing import CliRunner, Result
from rasterio.errors import NotGeoreferencedWarning
from support.example_survey import add_later_survey
from support.qgis import act, opened

from tunneldb.cli.main import main


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def write(output: Path, *options: str, survey: str = "demo-2024") -> Result:
    return CliRunner().invoke(main, ["qgis", survey, "-o", str(output), *options])


@pytest.fixture
def partly(conn: psycopg.Connection, example: str) -> None:
    """Blocks, of which one is inspected in part and one not at all; no images."""
    conn.execute("DELETE FROM tunnel.image WHERE kind <> 'corrected'")
    conn.execute(
        "UPDATE tunnel.element SET chainage_from = 12480, chainage_to = 12600 WHERE name = 'block 4';"
        " UPDATE tunnel.element SET chainage_from = 12300, chainage_to = 12308 WHERE name = 'block 2'"
    )
    conn.commit()


def pixels(path: Path) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        image = rasterio.open(path)
    with image:
        return image.read([1, 2, 3]).astype(int)  # type: ignore[no-any-return]


@pytest.mark.parametrize("layer", ["rating_map", "rating_unrolled"])
def test_results_are_styled_and_labelled(conn: psycopg.Connection, partly: None, tmp_path: Path, layer: str) -> None:
    """In the words of the scheme; what was not inspected in full is never drawn as the best result."""
    project = tmp_path / "demo.qgz"
    assert write(project, "--elements", "blocks", "--scheme", "example").exit_code == 0
    known = conn.execute("SELECT name, result, complete FROM tunnel_api.rating('demo-2024', 'blocks', 'example')").fetchall()
    seen = act(project, "results", layer)
    assert seen["title"].startswith("Rating of blocks by example 1")
    assert seen["legend"] == ["Not rated", "D", "At least D", "C", "At least C", "B", "At least B", "A", "At least A"]
    assert {"At least A", "Not rated"} <= {rule for rules, _ in seen["elements"].values() for rule in rules}
    for name, result, complete in known:
        words = "Not rated" if result is None else result if complete else f"At least {result}"
        text = words if complete and result else words[0].lower() + words[1:]
        assert seen["elements"][name] == [[words], f"{name}\n{text}"]


def test_a_review_changes_the_drawn_rating(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    project = tmp_path / "demo.qgz"
    assert write(project, "--elements", "zones", "--scheme", "example", "--scheme-version", "1").exit_code == 0
    before = act(project, "results", "rating_unrolled")["elements"]
    assert len(before) == 16
    conn.execute("UPDATE tunnel.finding SET review = 'rejected'")
    conn.commit()
    after = act(project, "results", "rating_unrolled")["elements"]
    assert {rule for rules, _ in after.values() for rule in rules} == {"A", "At least A"}
    assert before != after


def test_pictures_show_red_grey_and_hatches(conn: psycopg.Connection, partly: None, tmp_path: Path) -> None:
    conn.execute(
        "INSERT INTO tunnel_api.action (survey, finding_id, measure, due) VALUES"
        " ('demo-2024', 3, 'seal the joint', '2020-01-01'), ('demo-2024', 6, 'drain', NULL)"
    )
    conn.commit()
    project = tmp_path / "demo.qgz"
    assert write(project, "--elements", "blocks", "--scheme", "example").exit_code == 0
    rating, action = tmp_path / "rating.png", tmp_path / "action.png"
    with opened(project) as look:
        for theme in ("Map", "Unrolled"):
            assert look("render", theme, str(tmp_path / f"{theme}.png")) == {"saved": True, "errors": []}
        assert look("draw_layer", "rating_unrolled", "12295,-40,12505,44", str(rating))["saved"]
        assert look("draw_layer", "action_unrolled", "12295,-40,12505,44", str(action))["saved"]
    red, green, blue = pixels(rating)
    orange = (red > 220) & (green > 150) & (green < 230) & (blue < 200)
    assert orange.sum() > 5000, "block 3"
    assert not ((green > red + 25) & (green > blue + 25)).any(), "no block was found good"
    red, green, blue = pixels(action)
    assert ((red > 180) & (green < 40) & (blue < 40)).sum() > 20, "the overdue action"


def test_an_action_is_drawn_and_changed(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    """Also in the project of a later survey: it shows the actions of the tunnel."""
    add_later_survey(conn)
    conn.execute("DELETE FROM tunnel.image")
    conn.execute("DELETE FROM tunnel.action")
    conn.execute("INSERT INTO tunnel_api.action (survey, finding_id, measure) VALUES ('demo-2024', 1, 'drain')")
    conn.commit()
    project = tmp_path / "later.qgz"
    assert write(project, survey="demo-2026").exit_code == 0
    done = act(project, "write_action")
    assert done["added"]["saved"], done
    assert done["changed"]["saved"], done
    assert done["choices"] == {
        "urgency": ["immediate", "urgent", "planned", "monitor"], "state": ["open", "ordered", "done", "verified"],
    }  # fmt: skip
    assert done["due"] == "DateTime"
    row = conn.execute(
        "SELECT survey, chainage_from, chainage_to, arc, urgency, state, due::text, cost::float8, currency, overdue"
        " FROM tunnel_api.action WHERE measure = 'inject the joint'"
    ).fetchone()
    assert row == ("demo-2026", 12360.123, 12360.123, 1.5, "planned", "ordered", "2021-03-31", 1200.5, "EUR", True)
    assert act(project, "describe")["layers"]["action_map"]["features"] == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--scheme", "example"), "both --elements NAME and --scheme NAME"),
        (("--elements", "blocks"), "both --elements NAME and --scheme NAME"),
        (("--elements", "none", "--scheme", "example"), "has no elements named 'none'"),
        (("--elements", "blocks", "--scheme", "none"), "there is no rating scheme 'none'"),
    ],
)
def test_a_wrong_choice_is_one_line(conn: psycopg.Connection, example: str, tmp_path: Path, options: Any, message: str) -> None:
    result = write(tmp_path / "demo.qgz", *options)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert message in result.stderr
