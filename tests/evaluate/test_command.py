"""The command evaluate, on a survey made by hand whose leaks are known."""

from __future__ import annotations

import csv
import json

import numpy as np
import pyogrio.raw
import pytest
import shapely
from click.testing import CliRunner
from shapely.affinity import translate
from shapely.geometry import LineString, MultiPolygon, Point, box, mapping

from tunneldb.cli.main import main

pytestmark = pytest.mark.filterwarnings("ignore:'crs' was not provided")


def run(*arguments, code=0):
    result = CliRunner().invoke(main, [str(a) for a in arguments], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result


def refused(*arguments):
    """The one line that a command refuses with."""
    text = run("evaluate", *arguments, code=2).stderr
    assert text.startswith("tunneldb: ")
    assert text.count("\n") == 1
    return text


@pytest.fixture
def survey(conn, example):
    """A survey with stations, and 1000 m² of lining that were seen."""
    conn.execute(
        "INSERT INTO tunnel.station (survey_id, scan_id, geom) SELECT s.id, v.n, v.geom FROM tunnel.survey s,"
        " tunnel.axis_vertex v WHERE v.n % 2 = 0"
    )
    conn.execute("DELETE FROM tunnel.coverage")
    conn.execute(
        "INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet)"
        " SELECT id, 12, 500, '{700,900}', '{400,600}', '{0,7}' FROM tunnel.survey"
    )
    conn.commit()
    return example


def leaks(conn, where="review <> 'rejected'"):
    rows = conn.execute(
        f"SELECT ST_AsBinary(unrolled) FROM tunnel.finding WHERE kind = 'leak' AND {where} ORDER BY id"
    ).fetchall()
    conn.commit()
    return [shapely.from_wkb(bytes(row[0])) for row in rows]


def gpkg(path, shapes, layer="leak", crs=None):
    pyogrio.raw.write(
        str(path), shapely.to_wkb(np.array(shapes, dtype=object)), [np.arange(len(shapes)) + 101], np.array(["id"]),
        geometry_type=shapes[0].geom_type if shapes else "Polygon", crs=crs, driver="GPKG", layer=layer, append=path.exists(),
    )  # fmt: skip
    return path


def geojson(path, shapes, **members):
    features = [{"type": "Feature", "properties": {}, "geometry": mapping(s)} for s in shapes]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features, **members}))
    return path


def figures(survey, truth, folder, *options):
    run("evaluate", survey, truth, "-o", folder / "out.json", *options)
    return json.loads((folder / "out.json").read_text())


def test_the_leaks_themselves_are_perfect(conn, survey, tmp_path):
    found = figures(survey, gpkg(tmp_path / "truth.gpkg", leaks(conn)), tmp_path)
    everything = found["groups"][0]
    assert everything["group"] == "all"
    assert (everything["true"], everything["found"], everything["called"], everything["right"]) == (6, 6, 6, 6)
    assert everything["area_iou"] == pytest.approx(1.0)
    assert everything["edge_p95"] == pytest.approx(0.0, abs=1e-6)
    assert found["seen_m2"] == 1000.0
    assert everything["false_per_1000"] == 0.0
    assert [leak["id"] for leak in found["true"]] == ["101", "102", "103", "104", "105", "106"]
    # A point inside the leak is nearer to a station than half their distance of 20 m, its 4 m of radius added, and not at it.
    assert all(2.0 < leak["distance"] < 11.0 for leak in found["true"])


def test_figures_follow_what_is_changed(conn, survey, tmp_path):
    there = leaks(conn)
    truth = [there[0], translate(there[1], 0.1), there[2].buffer(0.1), box(12460, 0, 12461, 1), box(12465, 0, 12465.2, 0.2)]
    found = figures(survey, geojson(tmp_path / "truth.geojson", truth), tmp_path)
    everything = found["groups"][0]
    assert (everything["true"], everything["found"], everything["called"], everything["false"]) == (4, 3, 6, 3)
    assert everything["false_per_1000"] == pytest.approx(3.0)
    shared = sum(t.intersection(f).area for t, f in zip(truth[:3], there[:3], strict=True))
    assert everything["area_recall"] == pytest.approx(shared / sum(t.area for t in truth[:4]), abs=1e-4)
    assert everything["area_precision"] == pytest.approx(shared / sum(f.area for f in there), abs=1e-4)
    assert found["true"][2]["area_error"] == pytest.approx(1 - there[2].area / truth[2].area, abs=1e-4)
    text = run("evaluate", survey, tmp_path / "truth.geojson").stdout
    assert "of 0.1 m² and more (--min-area)" in text
    assert "3.00 false leaks per 1000 m² of the 1000 m²" in text
    assert "missed" in text


def test_lining_seen_before_there_was_a_coverage_is_that_of_the_ledger(conn, survey, tmp_path):
    conn.execute("DELETE FROM tunnel.coverage")
    conn.execute(
        """UPDATE tunnel.run SET counts = '{"lining_pixels": 200000}', parameters = '{"image.pixel": 0.1}'
            WHERE stage = 'detect'"""
    )
    truth = gpkg(tmp_path / "truth.gpkg", leaks(conn)[1:])
    found = figures(survey, truth, tmp_path)
    assert found["seen_m2"] == pytest.approx(2000.0)
    assert found["groups"][0]["false_per_1000"] == pytest.approx(0.5)
    conn.execute("UPDATE tunnel.run SET counts = '{}'")
    conn.commit()
    assert figures(survey, truth, tmp_path)["seen_m2"] is None


def test_an_inspector_s_word_counts(conn, survey, tmp_path):
    truth = gpkg(tmp_path / "truth.gpkg", leaks(conn))
    (key,) = conn.execute(
        "UPDATE tunnel.finding SET review = 'rejected' WHERE id = (SELECT min(id) FROM tunnel.finding) RETURNING id"
    ).fetchone()
    conn.commit()
    assert figures(survey, truth, tmp_path)["groups"][0]["found"] == 5
    conn.execute("UPDATE tunnel.finding SET review = 'confirmed', detected = false WHERE id = %s", [key])
    conn.commit()
    assert figures(survey, truth, tmp_path)["groups"][0]["found"] == 6


def test_polygons_in_space_are_carried_over(conn, survey, tmp_path):
    for form in ("gpkg", "geojson"):
        path = tmp_path / f"space.{form}"
        run("leaks", survey, "--geometry", "3d", "-o", path)
        everything = figures(survey, path, tmp_path)["groups"][0]
        assert (everything["true"], everything["found"], everything["called"]) == (7, 6, 6)  # the rejected one, too
        rejected = leaks(conn, "review = 'rejected'")[0].area
        assert everything["area_precision"] == pytest.approx(1.0, abs=1e-3)
        assert everything["area_recall"] == pytest.approx(1 - rejected / everything["true_area"], abs=2e-3)
        assert everything["edge_p95"] < 0.002


def test_unrolled_exports_are_read_as_they_are(survey, tmp_path):
    for form in ("gpkg", "geojson"):
        path = tmp_path / f"plane.{form}"
        run("leaks", survey, "-o", path)
        assert figures(survey, path, tmp_path)["groups"][0]["found"] == 6


def test_leaks_of_several_parts_and_of_other_kilometres(conn, survey, tmp_path):
    there = leaks(conn)
    truth = [MultiPolygon(there[:2]), MultiPolygon([box(15000, 0, 15001, 1)])]
    path = gpkg(tmp_path / "truth.gpkg", truth)
    everything = figures(survey, path, tmp_path)["groups"][0]
    assert (everything["true"], everything["found"], everything["right"]) == (1, 1, 2)
    assert "1 true leaks lie where leaks were not searched for" in run("evaluate", survey, path).stdout


def test_kinds_are_those_after_judging(conn, survey, tmp_path):
    truth = gpkg(tmp_path / "truth.gpkg", leaks(conn))
    before = figures(survey, truth, tmp_path)["groups"][0]
    conn.execute(
        "UPDATE tunnel.finding SET kind_override = 'dark' WHERE id = (SELECT min(id) FROM tunnel.finding WHERE kind = 'leak')"
    )
    conn.execute("UPDATE tunnel.finding SET kind_override = 'leak' WHERE kind = 'dark'")
    conn.commit()
    after = figures(survey, truth, tmp_path)["groups"][0]
    assert after["found"] == before["found"] - 1
    assert after["called"] == before["called"]  # one less, and the dark one more
    assert after["false"] == before["false"] + 1


def test_csv_has_a_row_for_each_group(conn, survey, tmp_path):
    run("evaluate", survey, gpkg(tmp_path / "t.gpkg", leaks(conn)), "-o", tmp_path / "out.csv", "--min-area", "0.5")
    rows = list(csv.DictReader((tmp_path / "out.csv").open()))
    assert [row["group"] for row in rows][:3] == ["all", "0.5 to 1 m²", "1 m² and more"]
    assert rows[1]["false_per_1000"] == ""
    assert float(rows[0]["area_f1"]) == pytest.approx(1.0)


def test_it_reads_only(conn, survey, tmp_path):
    def state():
        tables = conn.execute(
            "SELECT format('%I.%I', n.nspname, c.relname) FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace"
            " WHERE n.nspname = 'tunnel' AND c.relkind = 'r' ORDER BY 1"
        ).fetchall()
        rows = [
            conn.execute(f"SELECT md5(string_agg(t::text, ';' ORDER BY t::text)) FROM {name} t").fetchone()
            for (name,) in tables
        ]
        conn.rollback()
        return rows

    before = state()
    figures(survey, gpkg(tmp_path / "t.gpkg", leaks(conn)), tmp_path)
    assert state() == before


def test_files_that_are_no_truth_are_refused(conn, survey, tmp_path):
    there = leaks(conn)
    assert "no such file" in refused(survey, tmp_path / "none.gpkg")
    (tmp_path / "a.csv").write_text("no, truth")
    (tmp_path / "b.gpkg").write_text("nothing")
    assert "GeoPackage" in refused(survey, tmp_path / "b.gpkg")
    named = geojson(tmp_path / "named.geojson", there).read_bytes()
    (tmp_path / "named.geojson").write_bytes(named.replace(b"{", b'{"name": "l\xaaak", ', 1))
    assert "is not UTF-8" in refused(survey, tmp_path / "named.geojson")
    bow = shapely.Polygon([(12400, 0), (12401, 1), (12401, 0), (12400, 1)])
    assert "leak 101" in refused(survey, gpkg(tmp_path / "bow.gpkg", [bow]))
    assert "LineString" in refused(survey, gpkg(tmp_path / "line.gpkg", [LineString([(12400, 0), (12401, 1)])]))
    assert "Point" in refused(survey, geojson(tmp_path / "point.geojson", [Point(12400, 0)]))
    assert "is empty" in refused(survey, geojson(tmp_path / "empty.geojson", []))
    assert "is empty" in refused(survey, gpkg(tmp_path / "empty.gpkg", []))
    assert "EPSG:25830" in refused(survey, gpkg(tmp_path / "utm31.gpkg", there, crs="EPSG:25831"))
    assert "no heights" in refused(survey, gpkg(tmp_path / "flat.gpkg", there, crs="EPSG:25830"))
    off = shapely.force_3d(box(500_000, 4_640_300, 500_001, 4_640_301), 600.0)
    assert "off the tunnel" in refused(survey, gpkg(tmp_path / "off.gpkg", [off], crs="EPSG:25830"))
    assert "x must be the chainage" in refused(survey, geojson(tmp_path / "far.geojson", [box(-5, 43, -4, 44)]))


def test_layers_are_chosen(conn, survey, tmp_path):
    there = leaks(conn)
    path = gpkg(gpkg(tmp_path / "two.gpkg", there[:1], layer="leak"), there[:3], layer="dry")
    assert figures(survey, path, tmp_path)["groups"][0]["true"] == 1
    assert figures(survey, path, tmp_path, "--layer", "dry")["groups"][0]["true"] == 3
    assert "leak, dry" in refused(survey, path, "--layer", "wet")
    path = gpkg(gpkg(tmp_path / "others.gpkg", there[:1], layer="a"), there[:3], layer="b")
    assert "--layer" in refused(survey, path)


def test_surveys_and_kilometres_that_say_nothing(conn, survey, tmp_path):
    path = gpkg(tmp_path / "t.gpkg", leaks(conn))
    assert "no survey" in refused("nobody", path)
    assert "kilometre" in refused(survey, path, "--km", "13")
    assert ".json or .csv" in refused(survey, path, "-o", tmp_path / "x.txt")
    conn.execute("DELETE FROM tunnel.run WHERE stage = 'detect'")
    conn.commit()
    assert "no leak detection" in refused(survey, path)
    conn.execute("UPDATE tunnel.survey SET intensity_kind = 'none', intensity_dimension = NULL")
    conn.commit()
    assert "no intensity" in refused(survey, path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.gpkg"]
