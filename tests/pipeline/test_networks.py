"""A segmentation network of an owner: from a file into the database and into detection, alone and in a batch."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest
import shapely
from support.command import command
from support.databases import Copies
from support.toy_network import toy_network

from tests.pipeline.test_detect import NAME, START, counts, outlines, parameters, prepare
from tunneldb.segmentation.network import standard_network
from tunneldb.simulate import Simulation, generate, write
from tunneldb.simulate.lining.leaks import Leak

LENGTH = 10.0
BAND = shapely.box(START + 1.0, 2.0, START + LENGTH - 1.0, 2.5)
"""A wet band along nearly the whole tunnel: a threshold takes it for the level of dry lining."""


@pytest.fixture(scope="module")
def tunnel(copies: Copies, template: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A short tunnel with one wet band, run up to the ground."""

    def fill() -> None:
        folder = tmp_path_factory.mktemp("networks")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(generate, "place", lambda *_: [Leak(1, BAND, BAND.area, 4.0)])
            write(Simulation(parameters("static", 2, length=LENGTH)), folder)
        prepare(folder, "static")
        command("run", NAME, "--to", "ground")

    with copies.prepared(template, fill) as name:
        yield name


@pytest.fixture
def conn(copies: Copies, tunnel: str) -> Iterator[psycopg.Connection]:
    with copies.connected(tunnel) as connection:
        yield connection


@pytest.fixture
def toy(tmp_path: Path) -> Path:
    path = tmp_path / "toy.onnx"
    path.write_bytes(toy_network(version="toy 1"))
    return path


def wet(conn: psycopg.Connection) -> float:
    """Area of the band that leaks cover, as a share of it."""
    found = shapely.union_all(list(outlines(conn).values()))
    return float(found.intersection(BAND).area / BAND.area)


def test_what_a_network_takes_for_water_is_a_region_however_long(conn: psycopg.Connection, toy: Path) -> None:
    command("run", NAME, "--from", "detect", "--set", "detect.model=0")
    assert counts(conn)["network"] is None
    before = wet(conn)
    command("run", NAME, "--from", "detect", "--set", f"detect.model={toy}")
    assert wet(conn) > max(0.9, before + 0.3)
    (mean,) = conn.execute("SELECT max(darkening_mean) FROM tunnel_api.finding WHERE detected").fetchone()
    assert mean == pytest.approx(4.0, abs=0.5)  # relative to dry lining, of which the band is no part


def test_the_network_of_the_program_is_used_unless_another_is_given(conn: psycopg.Connection) -> None:
    command("run", NAME, "--from", "detect")
    assert counts(conn)["network"] == standard_network().version
    assert conn.execute("SELECT count(*) FROM tunnel.segmentation_network").fetchone() == (0,)  # it is not stored


def test_the_ledger_names_the_network_and_its_number_can_be_used_again(conn: psycopg.Connection, toy: Path) -> None:
    command("run", NAME, "--from", "detect", "--set", f"detect.model={toy}")
    (number, version, size) = conn.execute("SELECT id, version, bytes FROM tunnel_api.segmentation_network").fetchone()
    assert (version, size) == ("toy 1", toy.stat().st_size)
    assert counts(conn)["network"] == "toy 1"
    query = "SELECT parameters->'detect.model' FROM tunnel_api.run WHERE stage = 'detect' ORDER BY id DESC LIMIT 1"
    assert conn.execute(query).fetchone() == (number,)
    conn.rollback()
    first = outlines(conn)
    toy.unlink()
    command("run", NAME, "--from", "detect", "--set", f"detect.model={number}")
    assert outlines(conn).keys() == first.keys()  # the same leaks again
    assert counts(conn)["network"] == "toy 1"


def test_the_same_file_is_stored_once_and_a_batch_uses_it(conn: psycopg.Connection, toy: Path) -> None:
    command("batch", NAME, "--workers", "1", "--set", f"detect.model={toy}")
    assert counts(conn)["network"] == "toy 1"
    other = toy.with_name("copy.onnx")
    other.write_bytes(toy.read_bytes())
    command("run", NAME, "--from", "detect", "--set", f"detect.model={other}")
    assert conn.execute("SELECT count(*) FROM tunnel.segmentation_network").fetchone() == (1,)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("text.onnx", b"no network", "text.onnx: no segmentation network"),
        ("five.onnx", toy_network(channels=5), "five.onnx: no segmentation network: it has the inputs"),
        ("gone.onnx", None, "gone.onnx: No such file"),
    ],
)
def test_files_that_are_no_networks_are_refused(
    conn: psycopg.Connection, tmp_path: Path, name: str, content: bytes | None, said: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    result = command("run", NAME, "--from", "detect", "--set", f"detect.model={tmp_path / name}", code=2)
    assert said in result.output
    assert conn.execute("SELECT count(*) FROM tunnel.segmentation_network").fetchone() == (0,)


def test_a_number_without_a_network_is_refused_with_what_to_do(conn: psycopg.Connection, toy: Path) -> None:
    result = command("run", NAME, "--from", "detect", "--set", "detect.model=7", code=2)
    assert "tunneldb run SURVEY --set detect.model=FILE.onnx" in result.output
    command("run", NAME, "--from", "detect", "--set", f"detect.model={toy}")
