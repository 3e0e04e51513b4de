"""Surveys, ribbon, section, features: the numbers of the desk are those of the database."""

from __future__ import annotations

import numpy as np
import psycopg
import pytest
from web.conftest import SignIn


def test_ribbon_sums_are_those_of_the_statistics(signed_in: SignIn, conn: psycopg.Connection) -> None:
    ribbon = signed_in("viola_web").get("/api/surveys/demo-2024/ribbon").json()
    low, high = ribbon["from"], ribbon["from"] + ribbon["step"] * len(ribbon["wet"])
    wet, leaks = conn.execute(
        "SELECT wet_area, patches FROM tunnel_api.leak_statistics('demo-2024', %s, %s)", [low, high]
    ).fetchone()  # type: ignore[misc]
    assert sum(value or 0.0 for value in ribbon["wet"]) == pytest.approx(wet, rel=1e-6)
    (counted,) = conn.execute("SELECT count(*) FROM tunnel_api.finding WHERE counted").fetchone()  # type: ignore[misc]
    assert sum(map(sum, ribbon["findings"].values())) == counted
    assert leaks > 0
    assert {len(ribbon[name]) for name in ("wet", "inspected", "reviewed", "probability")} == {len(ribbon["wet"])}


def test_ribbon_has_the_deviation_of_the_lining(signed_in: SignIn) -> None:
    """The example lies 0.1 m outside its design everywhere, and 60 mm inside it from 12340 to 12343, else 40 mm."""
    ribbon = signed_in("viola_web").get("/api/surveys/demo-2024/ribbon").json()
    deviation = ribbon["deviation"]
    middles = ribbon["from"] + ribbon["step"] * (np.arange(len(ribbon["wet"])) + 0.5)
    assert deviation["layer"] == "lining"
    assert set(deviation["least"]) == {-0.1}
    greatest = np.array(deviation["greatest"])
    assert set(greatest[(middles > 12341) & (middles < 12342)]) == {0.06}
    assert set(greatest[(middles < 12339) | (middles > 12344)]) == {0.04}


def test_survey_without_a_design_has_no_deviation(signed_in: SignIn, conn: psycopg.Connection) -> None:
    conn.execute("DELETE FROM tunnel.deviation_section")
    conn.commit()
    assert signed_in("viola_web").get("/api/surveys/demo-2024/ribbon").json()["deviation"] is None


def test_survey_states_what_could_be_missed(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("viola_web")
    one = browser.get("/api/surveys/demo-2024/summary").json()
    assert one["statement"] == conn.execute("SELECT tunnel_api.coverage_statement('demo-2024')").fetchone()[0]  # type: ignore[index]
    assert one["remarks"] == [row[0] for row in conn.execute("SELECT said FROM tunnel_api.remarks('demo-2024')")]
    kinds = browser.get("/api/surveys/demo-2024").json()["kinds"]
    assert {kind["kind"] for kind in kinds} >= {"corrected", "raw", "offset", "state"}


def test_summary_has_the_class_of_the_database(signed_in: SignIn, conn: psycopg.Connection) -> None:
    one = signed_in("viola_web").get("/api/surveys/demo-2024/summary").json()
    row = conn.execute(
        "SELECT class, wet_area, seen_share, patches FROM tunnel_api.leak_statistics('demo-2024', '-infinity', 'infinity')"
    )
    assert (one["class"], one["wet_area"], one["inspected_share"], one["leaks"]) == row.fetchone()


def test_map_has_the_given_axes_of_all_tunnels(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """In degrees, at the place of the survey's axis; tunnels in local coordinates have none, sites are left out."""
    conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment) SELECT 'local', 0, start_chainage, spacing,"
        " public.ST_SetSRID(alignment, 0) FROM tunnel.tunnel WHERE name = 'demo'"
    )
    conn.commit()
    browser = signed_in("viola_web")
    found = {one["name"]: one["axis"] for one in browser.get("/api/tunnels").json()}
    assert found["local"] is None
    axis = browser.get("/collections/axis/items").json()["features"][0]["geometry"]["coordinates"]
    assert np.mean(found["demo"]["coordinates"], axis=0) == pytest.approx(np.mean(axis, axis=0), abs=1e-3)


def test_features_lie_where_the_tunnel_is(signed_in: SignIn, conn: psycopg.Connection) -> None:
    browser = signed_in("viola_web")
    names = [one["id"] for one in browser.get("/collections").json()["collections"]]
    assert {"leak_map", "finding_map", "axis"} <= set(names)
    found = browser.get("/collections/finding_map/items?survey=demo-2024&limit=1000").json()
    (count,) = conn.execute("SELECT count(*) FROM tunnel_api.finding_map WHERE survey = 'demo-2024'").fetchone()  # type: ignore[misc]
    assert found["numberReturned"] == count
    axis = browser.get("/collections/axis/items").json()["features"][0]["geometry"]["coordinates"]
    longitude, latitude = np.array(axis)[:, :2].mean(axis=0)
    west, south, east, north = longitude - 0.01, latitude - 0.01, longitude + 0.01, latitude + 0.01
    inside = browser.get(f"/collections/finding_map/items?limit=1000&bbox={west},{south},{east},{north}").json()
    assert inside["numberReturned"] == count
    assert browser.get("/collections/finding_map/items?bbox=0,0,1,1").json()["numberReturned"] == 0


@pytest.mark.parametrize(
    "path", ["/conformance", "/tiles", "/tileMatrixSets", "/tileMatrixSets/UnrolledPlane", "/tiles/demo-2024/corrected"]
)
def test_standards_are_described(signed_in: SignIn, path: str) -> None:
    assert signed_in("viola_web").get(path).status_code == 200


def test_every_collection_answers(signed_in: SignIn) -> None:
    browser = signed_in("viola_web")
    for one in browser.get("/collections").json()["collections"]:
        answer = browser.get(f"/collections/{one['id']}/items?limit=2")
        assert answer.status_code == 200, (one["id"], answer.text)
        for feature in answer.json()["features"]:
            assert feature["geometry"] is None or feature["geometry"]["type"]


def test_health(signed_in: SignIn) -> None:
    answer = signed_in("viola_web").get("/healthz")
    assert (answer.status_code, answer.text) == (200, "ok")
