"""Sections: curve, design and gauge of the example, on the page's values and in the drawing."""

from __future__ import annotations

import io
from urllib.parse import quote

import ezdxf
import numpy as np
import psycopg
import pytest
import shapely
from web.conftest import SignIn

SECTION = "/api/surveys/demo-2024/section?chainage=12350"
DRAWING = "/api/surveys/demo-2024/section.dxf?chainage=12350"


def test_curve_is_that_of_the_example(signed_in: SignIn) -> None:
    """A circle of 4 m with a floor 2.5 m below the axis."""
    curve = np.array(signed_in("viola_web").get(SECTION).json()["curve"])
    above = curve[curve[:, 1] > -2.3]
    assert np.hypot(*above.T) == pytest.approx(4.0, abs=0.02)
    assert curve[:, 1].min() == pytest.approx(-2.5, abs=0.02)


def test_design_and_gauge_lie_about_the_given_axis(signed_in: SignIn) -> None:
    """The design is a circle of 4 m; the gauge is 2 m wide and 4 m high, and stands 2 m below the axis."""
    lines = signed_in("viola_web").get(SECTION).json()["lines"]
    assert [(line["kind"], line["name"]) for line in lines] == [
        ("design", "lining: round"), ("gauge", "example, track single"),
    ]  # fmt: skip
    circle, gauge = (shapely.LineString(line["places"]) for line in lines)
    assert shapely.hausdorff_distance(circle, shapely.Point(0, 0).buffer(4.0, 256).exterior) < 0.005
    assert shapely.hausdorff_distance(gauge, shapely.box(-1.0, -2.0, 1.0, 2.0).exterior) < 0.005


def test_lines_follow_a_given_axis_beside_the_measured_one(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """If the given axis is 0.3 m higher than the lining was found, so is the design."""
    conn.execute("UPDATE tunnel.tunnel SET alignment = ST_Translate(alignment, 0, 0, 0.3) WHERE name = 'demo'")
    conn.commit()
    design = signed_in("viola_web").get(SECTION).json()["lines"][0]
    middle = shapely.LineString(design["places"]).envelope.centroid
    assert (middle.x, middle.y) == pytest.approx((0.0, 0.3), abs=0.005)


def test_gauge_leans_with_the_track(signed_in: SignIn, conn: psycopg.Connection) -> None:
    """A cant of 0.15 m on a track of 1.5 m leans the gauge by 1 in 10 to the right, about the middle of the track."""
    conn.execute("UPDATE tunnel.clearance_section SET cant = 0.15, track_right = 0.5")
    conn.commit()
    gauge = np.array(signed_in("viola_web").get(SECTION).json()["lines"][1]["places"])
    left_top = gauge[gauge[:, 1].argmax()]
    lean = np.arcsin(0.1)
    turned = np.array([[np.cos(lean), np.sin(lean)], [-np.sin(lean), np.cos(lean)]]) @ [-1.0, 4.0]
    assert left_top - [0.5, -2.0] == pytest.approx(turned, abs=0.01)


def test_drawing_has_the_lines_of_the_page(signed_in: SignIn) -> None:
    browser = signed_in("viola_web")
    answer = browser.get(DRAWING)
    assert answer.headers["content-disposition"] == 'attachment; filename="section-demo-2024-12350.00.dxf"'
    drawing = ezdxf.read(io.StringIO(answer.text))
    assert drawing.units == ezdxf.units.M
    assert not drawing.audit().errors
    page = browser.get(SECTION).json()
    shown = {"DESIGN": page["lines"][0]["places"], "GAUGE": page["lines"][1]["places"], "SECTION": page["curve"]}
    for layer, places in shown.items():
        (line,) = drawing.modelspace().query(f'LWPOLYLINE[layer=="{layer}"]')
        assert np.array(line.get_points("xy")) == pytest.approx(np.array(places), abs=1e-4)
    points = drawing.modelspace().query("POINT")
    assert len(points) == len(page["points"])


@pytest.mark.parametrize("name", ["Łódź", 'a".html', "a\r\nSet-Cookie: b=c", "0\nENDSEC\n0\nEOF"])
def test_drawing_of_a_survey_with_any_name(signed_in: SignIn, conn: psycopg.Connection, name: str) -> None:
    conn.execute("UPDATE tunnel.survey SET name = %s WHERE name = 'demo-2024'", [name])
    conn.commit()
    answer = signed_in("viola_web").get(DRAWING.replace("demo-2024", quote(name, safe="")))
    assert (
        answer.headers["content-disposition"]
        == f"attachment; filename*=utf-8''{quote(f'section-{name}-12350.00.dxf', safe='')}"
    )
    assert "set-cookie" not in answer.headers
    drawing = ezdxf.read(io.StringIO(answer.text))
    assert not drawing.audit().errors
    assert len(drawing.modelspace().query("TEXT")) == 1


@pytest.mark.parametrize("path", [SECTION, DRAWING])
def test_place_beyond_the_survey_is_refused(signed_in: SignIn, path: str) -> None:
    answer = signed_in("viola_web").get(path.replace("12350", "99999"))
    assert answer.status_code == 400
    assert answer.json()["error"].startswith("chainage=99999: the survey reaches from ")
