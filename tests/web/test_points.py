"""Points and outlines of the 3D view: those of the database, thinned evenly, and for viewers only."""

from __future__ import annotations

import json
import socket
import struct
import time
from typing import Any

import httpx2
import numpy as np
import psycopg
import pytest
import shapely
from support.desk_server import DeskServer
from support.example_objects import CORNER
from support.example_points import CABLE, CABLE_OFFSET, add_points
from support.example_survey import example_surface
from web.conftest import SignIn, sign_in

from tunneldb.store.desk import points as stored
from tunneldb.web import points as requests
from tunneldb.web import protocol

POINTS = "/api/surveys/demo-2024/points"
OUTLINES = "/api/surveys/demo-2024/outlines"


def read(content: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the header and the arrays of an answer."""
    (length,) = struct.unpack_from("<I", content)
    header = json.loads(content[4 : 4 + length])
    arrays = {
        one["name"]: np.frombuffer(content, one["type"], one["length"], 4 + length + one["at"]) for one in header["arrays"]
    }
    arrays["xyz"] = arrays["xyz"].reshape(-1, 3)
    return header, arrays


@pytest.fixture
def points(conn: psycopg.Connection, example: str) -> None:
    add_points(conn)


def stretch(browser: Any, low: float, high: float, limit: int = 300_000) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    answer = browser.get(f"{POINTS}?from={low}&to={high}&limit={limit}")
    assert answer.status_code == 200, answer.text
    return read(answer.content)


def test_points_are_those_of_the_view(signed_in: SignIn, conn: psycopg.Connection, points: None) -> None:
    """Positions to 1 mm, classes, and the intensity from the darkest to the brightest grey."""
    header, arrays = stretch(signed_in("viola_web"), 12340, 12360)
    rows = conn.execute(
        "SELECT ST_X(geom), ST_Y(geom), ST_Z(geom), class, intensity FROM tunnel_api.points('demo-2024', 12340, 12360)"
    ).fetchall()
    true = np.array(rows, float)
    assert header["count"] == header["total"] == len(true) == 12_000
    sent = np.column_stack([arrays["xyz"] + np.array(header["origin"]), arrays["class"], arrays["raw"]])
    nearest = shapely.STRtree(shapely.points(true[:, :3])).nearest(shapely.points(sent[:, :3]))
    assert len(set(nearest.tolist())) == len(true)
    assert np.abs(sent[:, :3] - true[nearest, :3]).max() < 0.001
    assert np.array_equal(sent[:, 3], true[nearest, 3])
    (about,) = [colour for colour in header["colours"] if colour["kind"] == "raw"]
    assert about["unit"] == "dB"
    share = np.clip((true[nearest, 4] - about["low"]) / (about["high"] - about["low"]), 0, 1)
    assert np.abs(sent[:, 4] - 1 - 254 * share).max() < 0.51


def test_thinning_is_even_along_the_stretch(signed_in: SignIn, points: None) -> None:
    """Each metre keeps the same share of its points, to what chance permits, and no end is cut off."""
    header, arrays = stretch(signed_in("viola_web"), 12340, 12390, 10_000)
    assert header["total"] == 30_000
    assert 9_200 < header["count"] <= 10_000
    place = example_surface()[0].unroll(arrays["xyz"] + np.array(header["origin"]))
    counts = np.histogram(place.chainage, np.arange(12340, 12391))[0]
    expected = header["count"] / 50
    assert ((counts - expected) ** 2 / expected).sum() < 95  # chi square, 49 degrees of freedom: 1 in 10,000 exceeds 93
    again, same = stretch(signed_in("viola_web"), 12340, 12390, 10_000)
    assert np.array_equal(same["xyz"], arrays["xyz"])
    assert again == header


def test_colours_are_those_of_the_images(signed_in: SignIn, conn: psycopg.Connection, points: None) -> None:
    """Offset of the points themselves; corrected intensity and deviation of the lining, not of the cable in front of it."""
    conn.execute(
        "INSERT INTO tunnel.image (survey_id, km, kind, block, tiff)"
        " SELECT survey_id, km, replace(kind, 'offset', 'deviation_lining'), block, tiff FROM tunnel.image"
        " WHERE kind IN ('offset', 'overview_offset')"
    )
    conn.commit()
    header, arrays = stretch(signed_in("viola_web"), 12340, 12360)
    assert [colour["kind"] for colour in header["colours"]] == ["raw", "corrected", "offset", "deviation_lining"]
    place = example_surface()[0].unroll(arrays["xyz"] + np.array(header["origin"]))
    assert np.abs(arrays["offset"] / 1000 - place.offset).max() < 0.001
    cable = (place.arc > CABLE[0] + 0.01) & (place.arc < CABLE[1] - 0.01)
    assert np.median(arrays["offset"][cable]) == pytest.approx(1000 * CABLE_OFFSET, abs=1)
    assert (arrays["deviation_lining"][cable] == -32768).all()
    assert (arrays["corrected"][cable] == 0).all()
    wall = np.abs(place.arc + 2) < 2
    assert (arrays["deviation_lining"][wall] != -32768).all()
    assert np.abs(arrays["deviation_lining"][wall]).max() < 200
    leak = np.hypot(place.chainage - 12344.0, place.arc + 5.2) < 0.4  # the second leak of the example
    assert np.median(arrays["corrected"][leak]) < np.median(arrays["corrected"][wall]) - 50
    assert set(np.unique(arrays["class"][np.abs(place.arc) > CORNER + 0.02])) == {2}


def test_a_survey_without_images_has_class_and_own_intensity(signed_in: SignIn, conn: psycopg.Connection, points: None) -> None:
    conn.execute("DELETE FROM tunnel.image")
    conn.commit()
    browser = signed_in("viola_web")
    assert [colour["kind"] for colour in stretch(browser, 12340, 12360)[0]["colours"]] == ["raw"]
    conn.execute("UPDATE tunnel.survey SET intensity_kind = 'none', intensity_dimension = NULL, reference = 'none'")
    conn.commit()
    header, arrays = stretch(browser, 12340, 12360)
    assert header["colours"] == []
    assert set(arrays) == {"xyz", "class"}


def test_the_axis_leads_through_the_stretch(signed_in: SignIn, points: None) -> None:
    header, _ = stretch(signed_in("viola_web"), 12340, 12360)
    axis = np.array(header["axis"])
    assert axis[:, 0] == pytest.approx(np.arange(12340, 12361))
    frames = example_surface()[0].frames(axis[:, 0])
    assert axis[:, 1:] + np.array(header["origin"]) == pytest.approx(frames[:, 0], abs=0.001)


@pytest.mark.parametrize(
    ("query", "status", "words"),
    [
        ("from=12340&to=12391", 400, "the stretch is 51.0 m long: at most 50 m"),
        ("from=12340&to=12340", 400, "state a stretch: from, and to, which is greater"),
        ("to=12340", 400, "state a stretch: from, and to, which is greater"),
        ("from=1&to=2", 400, "the stretch is outside the survey, which reaches from 12300.0 to 12500.0 m"),
        ("from=12340&to=12360&limit=999", 400, "limit=999: 1,000 to 1,000,000 points"),
        ("from=12340&to=12360&limit=nan", 400, "limit=nan"),
        ("from=x&to=12360", 400, "from=x: not a number"),
        ("from=12460&to=12480", 404, "no points of demo-2024 are stored from 12460.0 to 12480.0 m"),
    ],
)
def test_what_cannot_be_shown_is_stated(signed_in: SignIn, points: None, query: str, status: int, words: str) -> None:
    answer = signed_in("viola_web").get(f"{POINTS}?{query}")
    assert answer.status_code == status
    assert words in answer.json()["error"]


def test_a_stretch_ends_with_the_survey(signed_in: SignIn, points: None) -> None:
    header, _ = stretch(signed_in("viola_web"), 12290, 12340)
    assert (header["from"], header["to"]) == (12300, 12340)


def test_only_people_with_the_right_read_points(signed_in: SignIn, points: None) -> None:
    browser = signed_in("viola_web")
    for path in (POINTS, OUTLINES):
        assert browser.get(f"{path}?from=12340&to=12360").status_code == 200
        assert browser.get(f"{path.replace('demo-2024', 'nothing')}?from=12340&to=12360").status_code == 404
    browser.cookies.clear()
    for path in (POINTS, OUTLINES):
        assert browser.get(f"{path}?from=12340&to=12360").status_code == 401


def test_outlines_lie_on_the_lining(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """Findings that touch the stretch, of all states; their lines are those of the database."""
    found = signed_in("viola_web").get(f"{OUTLINES}?from=12395&to=12445").json()
    rows = conn.execute(
        "SELECT id, kind, review, state, ST_AsEWKB(surface) FROM tunnel_api.finding"
        " WHERE chainage_to > 12395 AND chainage_from < 12445 ORDER BY area DESC, id",
    ).fetchall()
    assert [(one["id"], one["kind"], one["review"], one["state"]) for one in found] == [row[:4] for row in rows]
    assert {"open", "confirmed", "rejected"} == {one["review"] for one in found}
    for one, (*_, surface) in zip(found, rows, strict=True):
        true = shapely.get_coordinates(shapely.from_wkb(bytes(surface)), include_z=True)
        assert np.array([place for line in one["lines"] for place in line]) == pytest.approx(true, abs=0.001)


@pytest.mark.parametrize("shape", ["POINT(12350 1)", "LINESTRING(12350 1, 12351 1.5, 12352 1)"])
def test_drawn_points_and_lines_have_outlines(signed_in: SignIn, conn: psycopg.Connection, shape: str) -> None:
    conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES ('demo-2024', 'other', ST_GeomFromText(%s, 0))",
        [shape],
    )
    conn.commit()
    (one,) = [one for one in signed_in("viola_web").get(f"{OUTLINES}?from=12345&to=12355").json() if one["kind"] == "other"]
    (line,) = one["lines"]
    assert (len(line) == 1) is shape.startswith("POINT")
    assert {len(place) for place in line} == {3}


def test_a_stretch_of_the_greatest_length_is_not_too_long_by_rounding(
    signed_in: SignIn, points: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """125.3 + 50 - 125.3 is more than 50 in floating point."""
    monkeypatch.setattr(requests, "measured", lambda survey: (0.0, 13_000.0))
    answer = signed_in("viola_web").get(f"{POINTS}?from=125.3&to=175.3")
    assert (answer.status_code, "no points of demo-2024 are stored" in answer.json()["error"]) == (404, True)


def test_answers_that_nobody_reads_end_and_are_few(
    logins: None, dsn: str, example: str, conn: psycopg.Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They would fill the memory of the server; meanwhile the person and others work."""
    patience = 4.0
    monkeypatch.setattr(protocol, "READ_SECONDS", patience)
    add_points(conn, 700_000, 12_330.0, 12_380.0)
    loaded: list[float] = []
    load = stored.load_points

    def counted(*arguments: Any) -> Any:
        loaded.append(time.monotonic())
        return load(*arguments)

    monkeypatch.setattr(stored, "load_points", counted)
    server = DeskServer(dsn)
    viola = httpx2.Client(base_url=server.address, timeout=60)
    sign_in(viola, "viola_web")  # type: ignore[arg-type]
    cookie = "; ".join(f"{name}={value}" for name, value in viola.cookies.items())
    request = f"GET {POINTS}?from=12330&to=12380&limit=1000000 HTTP/1.1\r\nHost: localhost\r\nCookie: {cookie}\r\n\r\n".encode()
    sockets = []
    for _ in range(2):
        reader = socket.socket()
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        reader.connect(("127.0.0.1", int(server.address.rpartition(":")[2])))
        reader.sendall(request)
        sockets.append(reader)
    end = time.monotonic() + 60
    while not loaded:
        assert time.monotonic() < end
        time.sleep(0.05)
    time.sleep(patience - 1.5)  # the second answer begins after the first was read from the database, and then given up
    assert len(loaded) == 1
    assert viola.get("/api/findings/1").status_code == 200
    assert viola.get(f"{POINTS}?from=12330&to=12340").status_code == 200
    assert loaded[1] - loaded[0] >= patience - 1.0
    for reader in sockets:
        reader.close()
    viola.close()
    server.stop()


@pytest.mark.parametrize("path", ["points?from=12330&to=12380", "section?chainage=12350", "section.dxf?chainage=12350"])
def test_a_refused_large_answer_ends_its_turn(signed_in: SignIn, points: None, path: str) -> None:
    browser = signed_in("viola_web")
    for survey, status in (("none", 404), ("demo-2024", 200), ("demo-2024", 200)):
        assert browser.get(f"/api/surveys/{survey}/{path}").status_code == status
