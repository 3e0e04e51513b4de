"""Design alignments from file to deviation: published files in the database, and a simulated tunnel beside its design."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner, Result
from PIL import Image
from scipy.optimize import brentq

from tunneldb.alignment.given import read_given
from tunneldb.cli.main import main
from tunneldb.simulate import Parameters, Simulation, write

DATA = Path(__file__).parents[1] / "data"
SRID = 6676  # the Japanese sample's


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def done(*arguments: object) -> Result:
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    return result


def refused(result: Result, *parts: str) -> None:
    assert result.exit_code == 2, (result.stderr, result.exception)
    assert result.stderr.startswith("tunneldb: ")
    assert result.stderr.count("\n") == 1
    for part in parts:
        assert part in result.stderr


def count(conn: psycopg.Connection, table: str) -> int:
    return conn.execute(f"SELECT count(*) FROM tunnel.{table}").fetchone()[0]  # type: ignore[index]


@pytest.fixture
def road(dsn: str) -> str:
    """A tunnel along the published Japanese road, with its two station equations."""
    result = done("tunnel", "add", "road", "--srid", SRID, "--axis", DATA / "j-landxml.xml")
    assert "1085.946 m of axis, chainage -90.000 to 995.946 m" in result.stderr
    assert "18 elements in plan, 5 in profile" in result.stderr
    return "road"


def test_elements_are_in_the_database(road: str, conn: psycopg.Connection) -> None:
    rows = conn.execute(
        "SELECT kind, turn, radius_from, radius_to, parameter, ST_Length(geom) - length FROM tunnel_api.alignment_element "
        "WHERE plane = 'horizontal' ORDER BY n"
    ).fetchall()
    kinds = re.findall(r"<(Line|Curve|Spiral) ", (DATA / "j-landxml.xml").read_text())
    assert [row[0] for row in rows] == [{"Line": "line", "Curve": "arc", "Spiral": "clothoid"}[kind] for kind in kinds]
    assert rows[1][1:5] == ("left", None, pytest.approx(250.0), pytest.approx(125.0))  # A = √(62.5 × 250)
    assert rows[10][1:5] == ("left", pytest.approx(140.0), pytest.approx(160.0), pytest.approx(200.0))  # as in the file
    assert rows[15][:4] == ("arc", "right", pytest.approx(220.0), pytest.approx(220.0))
    assert max(abs(row[5]) for row in rows) < 0.002
    grades = conn.execute(
        "SELECT kind, turn, grade_from, grade_to FROM tunnel_api.alignment_element WHERE plane = 'vertical' ORDER BY n"
    ).fetchall()
    assert [row[0] for row in grades] == ["grade", "parabola", "grade", "parabola", "grade"]
    assert grades[1][1:] == ("sag", pytest.approx(-2.1), pytest.approx(-1.5))
    assert conn.execute("SELECT design FROM tunnel_api.tunnel").fetchone() == ("j-landxml.xml: ○○路線",)


def test_pieces_of_the_map_lie_on_the_elements(road: str, conn: psycopg.Connection) -> None:
    """Each element's piece of the axis begins where the file has its beginning."""
    furthest = conn.execute(
        "SELECT max(ST_Distance(ST_StartPoint(v.geom), ST_SetSRID(ST_MakePoint(e.x, e.y), %s))) "
        "FROM tunnel_api.alignment_element v JOIN tunnel.alignment_element e USING (tunnel_id, plane, n) "
        "WHERE plane = 'horizontal'",
        [SRID],
    ).fetchone()
    assert furthest is not None
    assert furthest[0] < 0.002


def test_stations_are_the_files(road: str, conn: psycopg.Connection) -> None:
    """The station before an equation, which nothing stores, comes out as the file's staBack."""
    text = (DATA / "j-landxml.xml").read_text()
    stated = [(float(back), float(ahead)) for back, ahead in re.findall(r'staBack="([^"]*)".*staAhead="([^"]*)"', text)]
    found = conn.execute(
        "SELECT station_back, station FROM tunnel_api.station_equation WHERE station_back IS NOT NULL ORDER BY chainage"
    ).fetchall()
    np.testing.assert_allclose(found, stated, atol=1e-7)


def test_an_equation_at_the_very_end_is_left_out(dsn: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """The line that is kept ends a little before the design, whose arcs it cuts short."""
    last = '<StaEquation staBack="675.88262387" staInternal="675.50790516" staAhead="675.00000000"/>'
    for end in ("995.9461", "995.946183", "995.9462"):
        path = tmp_path / "road.xml"
        text = (DATA / "j-landxml.xml").read_text()
        assert last in text
        path.write_text(text.replace(last, f'{last}<StaEquation staBack="995" staInternal="{end}" staAhead="5000"/>'))
        done("tunnel", "add", f"t{end}", "--srid", SRID, "--axis", path)
    assert [row[0] for row in conn.execute("SELECT count(*) FROM tunnel.station_equation GROUP BY tunnel_id")] == [3, 3, 3]


def test_a_refused_tunnel_leaves_nothing(dsn: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    done("tunnel", "add", "t", "--srid", 25830, "--axis", DATA / "aplitop-3.ifc")
    elements = count(conn, "alignment_element")
    conn.rollback()
    assert elements == 20
    refused(run("tunnel", "add", "t", "--srid", 25830, "--axis", DATA / "aplitop-3.ifc"), "there is a tunnel 't' already")
    refused(run("tunnel", "add", "u", "--srid", 6459, "--axis", DATA / "indot-twin-branch.xml"), "US survey foot, not metres")
    path = tmp_path / "gap.xml"
    path.write_text((DATA / "indot-twin-branch.xml").read_text().replace("1321688.7797160002", "1321699"))
    refused(run("tunnel", "add", "v", "--srid", 6458, "--axis", path), str(path), "the length of the Line from 630097")
    refused(run("tunnel", "add", "w", "--srid", 25830, "--axis", tmp_path / "none.xml"), "No such file")
    assert (count(conn, "tunnel"), count(conn, "alignment_element")) == (1, elements)
    done("tunnel", "remove", "t")
    conn.rollback()
    assert count(conn, "alignment_element") == 0


def beside(conn: psycopg.Connection, tunnel: str, right: float, up: float) -> None:
    """A survey whose axis lies beside the design by given lengths, in the frame that follows from the design's elements."""
    design = read_given(DATA / "j-landxml.xml").design
    assert design is not None
    tunnel_id = conn.execute("SELECT id FROM tunnel.tunnel WHERE name = %s", [tunnel]).fetchone()[0]  # type: ignore[index]
    survey_id = conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform) "
        "VALUES (%s, 's', '2024-05-04', 'none', 'mobile') RETURNING id",
        [tunnel_id],
    ).fetchone()[0]  # type: ignore[index]
    number = np.arange(-9, 101)
    distance = number * 10.0 - design.start
    points = design.position(distance)
    step = 1e-3
    ahead = (design.position(distance + step) - design.position(distance - step)) / (2 * step)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    aside = np.cross(ahead, [0.0, 0.0, 1.0])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    # rising from nothing at the beginning to the whole at the end, so that no mean can pass for it
    share = (np.arange(len(number)) / (len(number) - 1))[:, None]
    measured = points + share * (right * aside + up * np.cross(aside, ahead))
    for n, given, found in zip(number.tolist(), points.tolist(), measured.tolist(), strict=True):
        conn.execute(
            "INSERT INTO tunnel.axis_vertex (survey_id, n, km, given, geom, points, source) VALUES "
            "(%s, %s, %s, ST_SetSRID(ST_MakePoint(%s, %s, %s), %s), ST_SetSRID(ST_MakePoint(%s, %s, %s), %s), 900, %s)",
            [survey_id, n, n // 100, *given, SRID, *found, SRID, "interpolated" if n == 50 else "measured"],
        )
    conn.commit()


def test_deviation_in_sql(road: str, conn: psycopg.Connection) -> None:
    beside(conn, road, 0.3, -0.2)
    rows = conn.execute("SELECT n, chainage, to_right, up FROM tunnel_api.axis_deviation(1) ORDER BY n").fetchall()
    assert [row[0] for row in rows] == list(range(-9, 100))  # vertex 100 lies beyond the end
    share = np.arange(109) / 109
    # 0.5 mm: a tangent from the vertices 10 m before and after is not quite that of the design where its curvature changes
    np.testing.assert_allclose([row[2] for row in rows], 0.3 * share, atol=5e-4)
    np.testing.assert_allclose([row[3] for row in rows], -0.2 * share, atol=5e-4)
    whole = conn.execute(
        "SELECT count(*), max(distance), max(label) FROM tunnel_api.axis_deviation WHERE survey = 's'"
    ).fetchone()
    assert whole == (109, pytest.approx(np.hypot(0.3, 0.2) * 108 / 109, abs=5e-4), "0+989.492")  # 990 m, less the equations


def test_axis_shows_and_draws_it(road: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    beside(conn, road, 0.3, -0.2)
    lines = done("axis", "s", "-o", tmp_path / "a.csv").stdout.splitlines()
    assert len(lines) == 1 + 18 + 1
    assert re.search(r"0\+447\.283 +0\+544\.896 +arc, R 160 m left +9 ", "\n".join(lines))
    # the interpolated vertex counts in no row: 108 of 109; the last one deviates most
    assert re.search(rf"all +108 +\+\d+\.\d +\+{300 * 108 / 109:.1f} +-\d+\.\d +-{200 * 108 / 109:.1f}", lines[-1])
    with (tmp_path / "a.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 109
    assert rows[-1]["label"] == "0+989.492"
    assert float(rows[-1]["to_right"]) == pytest.approx(0.3 * 108 / 109, abs=6e-4)

    part = done("axis", "s", "--from", "0+300", "--to", "0+400", "-o", tmp_path / "a.png").stdout.splitlines()
    assert part[-1].startswith("0+300.375")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.width > 1000
        assert len(picture.convert("RGB").getcolors(1_000_000)) > 20
    # of a stretch with nothing but the vertex that was carried along there is a picture, too
    alone = done("axis", "s", "--from", "499", "--to", "501", "-o", tmp_path / "alone.png").stdout.splitlines()
    assert re.fullmatch(r"0\+500\.375 +0\+500\.375 +all +0 *", alone[-1])
    done("axis", "s", "-o", tmp_path / "a.svg")
    svg = ElementTree.parse(tmp_path / "a.svg").getroot()
    assert svg.tag.endswith("svg")
    refused(run("axis", "s", "-o", tmp_path / "a.xlsx"), ".png, .pdf, .svg (a figure) or .csv (a table)")
    assert not (tmp_path / "a.xlsx").exists()


def test_axis_without_an_axis(road: str, conn: psycopg.Connection) -> None:
    conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform) "
        "SELECT id, 's', '2024-05-04', 'none', 'mobile' FROM tunnel.tunnel"
    )
    conn.commit()
    refused(run("axis", "s"), "survey s has no axis there: tunneldb run s --to axis")
    refused(run("axis", "x"), "there is no survey 'x'")


def test_a_simulated_tunnel_lies_beside_a_shifted_design(dsn: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    """The tunnel is built by the simulator, its design is moved aside; scanned and averaged, the axis shows the shift."""
    parameters = Parameters(
        name="curve", section="circular", seed=7, length=140.0, start_chainage=960.0, radius=300.0, straight=30.0,
        transition=40.0, slope=3.0, slope_end=-2.0, scanner="profiler", density=60.0, leaks=0,
    )  # fmt: skip
    simulation = Simulation(parameters)
    write(simulation, tmp_path)
    shift = np.array([0.12, -0.05, -0.03])
    (tmp_path / "design.xml").write_text(as_landxml(simulation, shift))
    done("tunnel", "add", "curve", "--srid", 25830, "--axis", tmp_path / "design.xml")
    done(
        "survey", "add", "curve", "--tunnel", "curve", "--date", "2024-05-04", "--trajectory",
        tmp_path / "curve.trajectory.csv", "--intensity-kind", "none",
    )  # fmt: skip
    done("load", "curve", tmp_path / "curve.laz")
    done("run", "curve", "--to", "axis")
    done("axis", "curve", "-o", tmp_path / "curve.csv")
    with (tmp_path / "curve.csv").open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["source"] == "measured"]
    chainage, right, up = (np.array([float(row[name]) for row in rows]) for name in ("chainage", "to_right", "up"))
    assert len(rows) >= 13
    frame = simulation.tunnel.line.frame(chainage)
    np.testing.assert_allclose(right, -frame.u @ shift, atol=0.006)
    # The simulator's line runs through the middle of the circle, the averaged axis where, 22.5° from straight up (the middle
    # of the classes of the vault), the circle is as far as the floor in the opposite direction.
    raised = up + frame.w @ shift
    assert raised.std() < 0.004
    crown, floor = simulation.tunnel.section.point(np.array([0.0, simulation.tunnel.section.half_perimeter]))[0][:, 1]
    cosine, sine = np.cos(np.pi / 8), np.sin(np.pi / 8)
    middle = brentq(lambda c: np.sqrt(crown**2 - (c * sine) ** 2) - c * cosine - (c - floor) / cosine, 0.0, 2.0)
    assert raised.mean() == pytest.approx(middle, abs=0.005)


def as_landxml(simulation: Simulation, shift: np.ndarray) -> str:
    """The simulator's line as a LandXML of line, clothoid, arc and parabola, moved by a vector (m)."""
    line = simulation.tunnel.line
    ends = [*line.plan[:, 0], line.end]

    def point(tag: str, at: np.ndarray) -> str:
        east, north = at[:2] + shift[:2]
        return f"<{tag}>{north:.9f} {east:.9f}</{tag}>"

    elements = ""
    for row, low, high in zip(line.plan, ends, ends[1:], strict=False):
        begin, end = line.position(np.array([low, high]))
        rest = f'length="{high - low}" rot="cw"'
        places = point("Start", begin), point("End", end)
        curvature, change = row[4], row[5]
        if change:
            elements += (
                f'<Spiral {rest} radiusStart="INF" radiusEnd="{-1 / (change * (high - low))}">{"".join(places)}</Spiral>'
            )
        elif curvature:
            left = line.frame(np.array([low])).u[0] * -1
            centre = begin + left / curvature
            elements += f"<Curve {rest}>{places[0]}{point('Center', centre)}{places[1]}</Curve>"
        else:
            elements += f"<Line>{''.join(places)}</Line>"
    z = line.position(np.array([line.start, line.end]))[:, 2] + shift[2]
    (_, first, _), length = line.profile[:, 0], line.profile[2, 0] - line.profile[1, 0]
    middle = first + length / 2
    height = z[0] + line.profile[0, 2] * (middle - line.start)
    profile = (
        f'<PVI>{line.start} {z[0]}</PVI><ParaCurve length="{length}">{middle} {height}</ParaCurve><PVI>{line.end} {z[1]}</PVI>'
    )
    return (
        '<LandXML version="1.2"><Units><Metric linearUnit="meter"/></Units>'
        f'<Alignments><Alignment name="curve" staStart="{line.start}"><CoordGeom>{elements}</CoordGeom>'
        f"<Profile><ProfAlign>{profile}</ProfAlign></Profile></Alignment></Alignments></LandXML>"
    )
