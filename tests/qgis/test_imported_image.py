"""Images of other instruments in the project: valid layers in their place, with the colours of their kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from PIL import Image
from support.example_survey import NAME
from support.imported_image import SPOTS, STATED, strip, write
from support.qgis import opened

from tunneldb.cli.main import main


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def run(*words: object) -> None:
    done = CliRunner().invoke(main, [str(word) for word in words])
    assert done.exit_code == 0, done.output


def test_imported_images_are_layers(conn: psycopg.Connection, example: str, tmp_path: Path) -> None:
    conn.execute("DELETE FROM tunnel.image WHERE kind <> 'corrected'")
    conn.commit()
    photo = np.full((3, 200, 300), 90, np.uint8)
    run("image", "import", NAME, write(tmp_path / "a.tif", strip(STATED), STATED, "°C"), "--kind", "thermal", "--name", "raw")
    run("image", "import", NAME, write(tmp_path / "p.tif", photo, STATED, photometric="RGB"), "--kind", "photo")
    run("qgis", NAME, "-o", tmp_path / "demo.qgs")
    text = (tmp_path / "demo.qgs").read_text()
    assert 'name="Imported: thermal, raw, °C"' in text
    assert 'name="Imported: photo"' in text
    thermal = text.split("<id>tunneldb_layer_demo-2024-km012-imported-raw</id>")[1].split("</pipe>")[0]
    assert 'type="singlebandpseudocolor"' in thermal
    assert "°C" in thermal
    assert (
        'type="multibandcolor"' in text.split("<id>tunneldb_layer_demo-2024-km012-imported-photo</id>")[1].split("</pipe>")[0]
    )
    # 1 m by 1 m around each hot spot, which is bright in its middle and dark at the edges
    pictures = []
    with opened(tmp_path / "demo.qgs") as look:
        seen = look("describe")
        for n, (x, y) in enumerate(SPOTS[::2]):
            pictures.append(tmp_path / f"spot-{n}.png")
            box = f"{x - 0.5},{y - 0.5},{x + 0.5},{y + 0.5}"
            assert look("draw_layer", "demo-2024-km012-imported-raw", box, str(pictures[-1]))["errors"] == []
    for name in ("raw", "photo"):
        assert seen["layers"][f"demo-2024-km012-imported-{name}"]["valid"]
    for picture in pictures:
        shown = np.asarray(Image.open(picture).convert("RGB")).astype(int)
        rows, columns = shown.shape[:2]
        assert shown[rows // 2, columns // 2, 0] > 200
        assert shown[rows // 20, columns // 2, 0] < 100
