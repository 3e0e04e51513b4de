"""A segmentation network of known answers, run on pictures; and that of the program."""

import os
import subprocess
import sys

import numpy as np
import pytest
from support.toy_network import toy_network, wide_network

from tunneldb.errors import UserError
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import FaceGrid
from tunneldb.raster.image import CONTEXT, LiningImage
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.channels import PIXEL, REACH
from tunneldb.segmentation.network import BEYOND, CERTAIN, FIELD, HALF, Network


def picture(columns=3000, pixel=0.02, seed=1, first=0):
    """Lining of -20 dB with noise, and a patch of 1 m x 2 m that is 4 dB darker."""
    rng = np.random.default_rng(seed)
    rows = round(12.0 / pixel)
    level = np.rint(100 * (-20 + rng.normal(0, 0.2, (rows, columns)))).astype(np.int16)
    patch = np.zeros(level.shape, np.bool_)
    patch[round(4 / pixel) : round(5 / pixel), round(20 / pixel) : round(22 / pixel)] = True
    level[patch] -= 400
    state = np.full(level.shape, PixelState.LINING, np.uint8)
    return LiningImage(FaceGrid(pixel, -rows // 2, rows, first, columns), state, level), patch


def test_a_patch_is_water_up_to_its_edge():
    one, patch = picture()
    wet = Network.load(toy_network(), "toy").water(one) >= HALF
    assert abs(wet.sum() - patch.sum()) < 0.06 * patch.sum()
    assert (wet & patch).sum() > 0.95 * patch.sum()


@pytest.mark.parametrize(("pixel", "area"), [(0.01, 2.0), (0.04, 2.0), (0.05, 2.0), (0.08, 2.0), (0.2, 2.0)])
def test_pixels_of_any_size(pixel, area):
    one, _ = picture(columns=round(60 / pixel), pixel=pixel)
    wet = Network.load(toy_network(), "toy").water(one) >= HALF
    assert wet.sum() * pixel**2 == pytest.approx(area, rel=0.15)


def test_fixtures_and_the_floor_are_never_wet_and_empty_pixels_can_be():
    one, patch = picture()
    one.state[205:210, 1000:1100], one.state[230:235] = PixelState.OFF, PixelState.FLOOR
    one.state[240:245, 1000:1100], one.level[240:245, 1000:1100] = PixelState.EMPTY, NODATA
    found = Network.load(toy_network(), "toy").water(one)
    assert not found[205:210, 1000:1100].any()
    assert not found[230:235].any()
    assert (found[240:245, 1010:1090] >= HALF).all()
    assert found[patch].max() == CERTAIN


def test_parts_with_their_context_give_what_the_whole_gives(monkeypatch):
    """Wherever a picture is cut, and however long the strips: with what the network sees, up to a step of 1/255."""
    network = Network.load(wide_network(), "wide")
    whole, _ = picture(columns=6000, first=1237)
    expected = network.water(whole).astype(int)
    assert expected.std() > 10
    around = round(CONTEXT / whole.grid.pixel)
    for first, stop in ((0, 2500), (2500, 4100), (4100, 6000)):
        low, high = max(first - around, 0), min(stop + around, 6000)
        grid = FaceGrid(0.02, whole.grid.bottom, whole.grid.rows, 1237 + low, high - low)
        part = LiningImage(grid, whole.state[:, low:high].copy(), whole.level[:, low:high].copy())
        found = network.water(part)[:, first - low : stop - low].astype(int)
        assert np.abs(found - expected[:, first:stop]).max() <= 1
    monkeypatch.setattr("tunneldb.segmentation.network.STRIP", 320)
    assert np.abs(network.water(whole).astype(int) - expected).max() <= 1


def test_the_number_of_threads_changes_nothing(monkeypatch):
    monkeypatch.setattr("tunneldb.segmentation.network.STRIP", 320)
    one, _ = picture(columns=4000)
    found = []
    for count in (1, 4):
        monkeypatch.setattr("tunneldb.threads._chosen", [count])
        found.append(Network.load(wide_network(), "wide").water(one))
    np.testing.assert_array_equal(found[0], found[1])


def test_the_context_of_a_kilometre_is_what_the_network_sees():
    assert CONTEXT >= (REACH + FIELD + BEYOND) * PIXEL


@pytest.mark.parametrize(
    ("content", "what"),
    [(b"no network", "rotobuf"), (toy_network(channels=5), r"images.*not images \(1, 13"), (b"", "No graph")],
)
def test_other_files_are_no_networks(content, what):
    with pytest.raises(ValueError, match=what):
        Network.load(content, "x")


def test_a_network_that_gives_no_probabilities_is_refused():
    with pytest.raises(UserError, match="gives no probabilities"):
        Network.load(toy_network(steepness=np.nan), "toy").water(picture()[0])


def test_a_network_has_the_version_of_its_metadata_or_its_file():
    assert Network.load(toy_network(version="owner 3"), "file").version == "owner 3"
    assert Network.load(toy_network(), "file").version == "file"


def test_nothing_is_kept_or_sent(tmp_path):
    """ONNX Runtime would keep usage data for Microsoft in the home folder and in TMPDIR."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "ORT_"))}
    environment |= {"HOME": str(tmp_path), "TMPDIR": str(tmp_path)}
    code = "from tunneldb.segmentation.network import standard_network; assert standard_network().session"
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    kept = [str(path) for path in tmp_path.rglob("*") if path.is_file() and "numba" not in str(path).lower()]
    assert kept == []
