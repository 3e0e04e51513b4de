"""A profiler that went fast: profiles half a metre apart, through the real commands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
import shapely

from tests.pipeline.test_detect import APPENDAGE, NAME, START, command, counts, outlines, parameters, prepare, share_of
from tunneldb.raster.geotiff import decode
from tunneldb.simulate import Simulation, generate, write
from tunneldb.simulate.lining.leaks import Leak

SPACING = 0.5
WET = [
    shapely.affinity.scale(shapely.Point(START + x, y).buffer(1.0), along, around)
    for x, y, along, around in ((4.0, 3.5, 1.4, 0.4), (11.1, -3.0, 0.9, 0.6), (17.3, 0.5, 1.6, 0.8))
]


def test_leaks_over_several_profiles_are_found_once_and_with_their_area(
    conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No slices, no cables, and the images show what was counted as seen."""
    monkeypatch.setattr(generate, "place", lambda *_: [Leak(k, wet, wet.area, 4.0) for k, wet in enumerate(WET, 1)])
    write(Simulation(parameters("profiler", 1, profile_spacing=SPACING, niches=False)), tmp_path)
    prepare(tmp_path, "profiler")
    command("run", NAME)
    found = list(outlines(conn).values())
    rows = conn.execute("SELECT kind, image_share FROM tunnel.finding ORDER BY id").fetchall()
    assert [kind for kind, _ in rows] == ["leak"] * len(WET)
    assert all(share == pytest.approx(0.02 / SPACING, rel=0.5) for _, share in rows)
    for leak in WET:
        (same,) = [polygon for polygon in found if polygon.intersects(leak)]
        assert same.area == pytest.approx(leak.area, rel=0.25)
        assert same.intersection(leak).area / leak.area > 0.8
        assert share_of(tmp_path, same, APPENDAGE) < 0.05
    assert sum(polygon.area for polygon in found) == pytest.approx(sum(leak.area for leak in WET), rel=0.1)

    ledger = counts(conn)
    assert ledger["profile_spacing"] == pytest.approx(SPACING, abs=0.021)
    assert "0.5 m apart" in str(ledger["note"])
    assert ledger["seen"] > 0.75  # what cables hide is not seen
    ((tiff,), *_) = conn.execute(
        "SELECT tiff FROM tunnel.image WHERE kind = 'corrected' ORDER BY block", binary=True
    ).fetchall()
    first, stop = (round((START % 50.0 + metres) / 0.02) for metres in (2.0, 20.0))
    shown = decode(tiff).values[:, first:stop]
    assert np.isfinite(shown).any(axis=0).all()


def test_a_survey_too_thin_to_be_searched_is_unseen_and_not_clean(conn: psycopg.Connection, tmp_path: Path) -> None:
    """At 5 points/m² nothing can be told: no leaks, none of the lining seen, and every document says so first."""
    write(Simulation(parameters("profiler", 1, density=5.0)), tmp_path)
    said = prepare(tmp_path, "profiler", "reflectance")
    assert "lining with fewer than 12 is not searched for leaks, and counts as not inspected" in said
    assert "too few to distinguish wet from dry" in command("run", NAME).output
    assert outlines(conn) == {}
    assert counts(conn)["seen"] < 0.01
    assert counts(conn)["sparse"] > 0.99
    gaps = conn.execute("SELECT chainage_from, chainage_to FROM tunnel_api.coverage_gap ORDER BY 1").fetchall()
    assert gaps[0][0] == pytest.approx(START, abs=1.0)
    assert gaps[-1][1] == pytest.approx(START + 24.0, abs=1.0)
    assert sum(high - low for low, high in gaps) == pytest.approx(24.0, abs=1.0)
    shown = command("leaks", NAME, code=1).output
    assert "Searched, but unseen" in shown
    assert "0 leaks" not in shown
    remarks = [row[0] for row in conn.execute("SELECT remark FROM tunnel_api.remark WHERE stage = 'detect'").fetchall()]
    assert any("counts as not inspected" in remark for remark in remarks)
