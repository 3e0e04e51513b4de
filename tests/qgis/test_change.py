"""What changed since an older survey, in the project of the newer one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
import rasterio
from click.testing import CliRunner
from support.example_change import EARLIER, IMAGE, LEAKS, REGIONS, add_earlier
from support.qgis import opened

from tunneldb.cli.main import main

REGION = {"change_region_map": "Polygon", "change_region_unrolled": "Polygon", "change_region_3d": "PolygonZ"}
LEAK = {"leak_change_map": "MultiPolygon", "leak_change_unrolled": "MultiPolygon"}
PICTURE = "demo-2024-km012-change"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def compared(conn: psycopg.Connection, example: str) -> str:
    """A survey that was compared with an older one."""
    add_earlier(conn, example)
    conn.execute("DELETE FROM tunnel.image WHERE kind <> 'offset'")
    conn.commit()
    return example


def write(survey: str, path: Path) -> None:
    result = CliRunner().invoke(main, ["qgis", survey, "-o", str(path)])
    assert result.exit_code == 0, result.output


def test_layers_of_change_are_drawn_and_labelled(compared: str, tmp_path: Path) -> None:
    path = tmp_path / "demo.qgs"
    write(compared, path)
    with opened(path) as look:
        seen = look("describe")
        regions, leaks = look("labels", "change_region_unrolled"), look("labels", "leak_change_unrolled")
    for name, kind in (REGION | LEAK).items():
        layer = seen["layers"][name]
        rows = len(REGIONS) if name in REGION else len(LEAKS)
        assert (layer["valid"], layer["wkb"], layer["features"], layer["error"]) == (True, kind, rows, ""), name
        assert layer["crs"] == ("" if name.endswith("unrolled") else "EPSG:25830"), name
        assert (layer["read_only"], layer["labels"]) == (True, True), name
        assert set(layer["aliases"]) == set(layer["widget"]) - {"geom"}, name
    space = seen["layers"]["change_region_3d"]
    assert (space["clamping"], space["binding"]) == ("absolute", "vertex")
    themes = {name: set(layers) for name, layers in seen["themes"].items()}
    assert themes["Change"] == {"change_region_unrolled", "leak_change_unrolled", "sheet", PICTURE}
    assert themes["Change on the map"] == {"change_region_map", "leak_change_map", "axis", "outline"}
    assert "change_region_3d" in themes["3D"]
    assert not {*REGION, *LEAK, PICTURE} & (themes["Map"] | themes["Unrolled"])
    assert (sorted(regions["texts"]), regions["error"]) == (["+4.0 mm", "-6.0 mm"], "")
    assert any(text.endswith("grown\n1.00 → 3.00 m²") for text in leaks["texts"]), leaks
    assert any(text.endswith("dry again\n0.30 → 0.00 m²") for text in leaks["texts"]), leaks


def test_image_and_layers_are_there_where_there_are_rows(conn: psycopg.Connection, compared: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.change_region")
    conn.commit()
    path = tmp_path / "demo.qgs"
    write(compared, path)
    text = path.read_text()
    assert all(f"<id>tunneldb_layer_{name}</id>" in text for name in (*LEAK, PICTURE))
    assert not any(name in text for name in REGION)
    assert f"<layername>What became of leaks, since {EARLIER}</layername>" in text
    drawn = text.split(f"<id>tunneldb_layer_{PICTURE}</id>")[1].split("</pipe>")[0]
    assert all(f'label="{label}"' in drawn for label in ("-5 mm", "-2 mm", "+0 mm", "+2 mm", "+5 mm"))
    with rasterio.open(tmp_path / "demo-images" / f"{PICTURE}.tif") as image:
        assert image.bounds == pytest.approx((12320.0, 0.5, 12321.0, 1.0))
        np.testing.assert_allclose(image.read(1), IMAGE, atol=1e-6)
        assert EARLIER in image.descriptions[0]
