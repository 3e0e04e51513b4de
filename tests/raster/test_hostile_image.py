"""What GDAL would open that is no image and no map: files that have it read other files."""

from __future__ import annotations

import json
from pathlib import Path

import pyogrio
import pytest

from tunneldb.errors import UserError
from tunneldb.files import vector_source
from tunneldb.raster.geotiff import decode

RIGHT = {
    "type": "FeatureCollection",
    "features": [{"type": "Feature", "properties": {"kind": "crack"}, "geometry": {"type": "Point", "coordinates": [1, 2]}}],
}


def test_an_image_in_the_database_reads_no_file(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(range(100)))
    vrt = f"""<VRTDataset rasterXSize="10" rasterYSize="10"><VRTRasterBand dataType="Byte" band="1" subClass="VRTRawRasterBand">
    <SourceFilename relativeToVRT="0">{secret}</SourceFilename><ImageOffset>0</ImageOffset><PixelOffset>1</PixelOffset>
    <LineOffset>10</LineOffset></VRTRasterBand></VRTDataset>"""
    with pytest.raises(UserError, match="is not a GeoTIFF; run stage detect again"):
        decode(vrt.encode())


@pytest.mark.parametrize("name", ["a.geojson", "a.gpkg", "a.shp", "a.fgb"])
@pytest.mark.parametrize(
    "text",
    [
        '<OGRVRTDataSource><OGRVRTLayer name="right"><SrcDataSource>{right}</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>',
        '{{"type": "gdal_streamed_alg", "command_line": "gdal vector filter --input {right} --output streamed_dataset"}}',
    ],
    ids=["VRT", "pipeline"],
)
def test_a_file_of_shapes_reads_no_other(tmp_path: Path, name: str, text: str) -> None:
    right, path = tmp_path / "right.geojson", tmp_path / name
    right.write_text(json.dumps(RIGHT))
    path.write_text(text.format(right=right))
    with pytest.raises((UserError, pyogrio.errors.DataSourceError)):
        pyogrio.raw.read(vector_source(path))
    assert len(pyogrio.raw.read(vector_source(right))[2]) == 1
