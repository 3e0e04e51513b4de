"""The command ground: scan files by themselves, of all sorts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
from click.testing import CliRunner
from support.real_scans import real_scan

from tunneldb.classification.classes import PointClass
from tunneldb.cli.main import main
from tunneldb.export.pointcloud import single_file as bare
from tunneldb.simulate import Parameters, Simulation, write

pytestmark = pytest.mark.slow

FLOOR, LINING = 1, 0  # of the truth
ORIGIN = np.array([500_000.0, 4_500_000.0, 100.0])


def ground(source: Path, target: Path, *options: object, code: int = 0) -> str:
    result = CliRunner().invoke(main, ["ground", str(source), "-o", str(target), *map(str, options)], catch_exceptions=False)
    assert result.exit_code == code, result.output
    if code:
        assert result.output.count("\n") == 1
        assert result.output.startswith("tunneldb: ")
        assert not target.exists() or target.samefile(source)
    assert [path for path in target.parent.iterdir() if path.name.startswith(".")] == []
    return result.output


def save(path: Path, xyz: np.ndarray, scale: float = 0.001) -> Path:
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales = [scale] * 3
    header.offsets = np.floor(xyz.min(axis=0)) if len(xyz) else ORIGIN
    las = laspy.LasData(header)
    las.x, las.y, las.z = xyz.T
    las.write(path)
    return path


@pytest.fixture(scope="module")
def tunnel(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """A scan of 20 m of a curved, rising tunnel, and the truth of its points."""
    folder = tmp_path_factory.mktemp("tunnel")
    simulation = Simulation(
        Parameters(
            length=20.0, section="horseshoe", radius=300.0, straight=0.0, slope=3.0, scanner="profiler", density=1000.0,
            leaks=0, people=2, equipment=2, ballast=0.01,
        )
    )  # fmt: skip
    made = write(simulation, folder)
    return made.clouds[0], np.load(made.truth[0])["class"]


def test_tunnel(tunnel: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    source, truth = tunnel
    text = ground(source, tmp_path / "out.laz")
    las = laspy.read(tmp_path / "out.laz")
    np.testing.assert_array_equal(las.xyz, laspy.read(source).xyz)
    found = np.asarray(las.classification)
    assert np.mean((found == PointClass.GROUND) == (truth == FLOOR)) > 0.98
    assert np.mean(found[truth == LINING] == PointClass.LINING) > 0.9
    assert "ground" in text
    assert f"{np.count_nonzero(found == PointClass.GROUND):,}".replace(",", " ") in text
    assert "no ground" not in text
    assert "no lining" not in text


def test_far_from_the_origin(tunnel: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    """The same classes, also where coordinates leave few digits for millimetres."""
    source, truth = tunnel
    xyz = np.asarray(laspy.read(source).xyz)
    far = save(tmp_path / "far.laz", xyz + np.array([3e8, -7e8, 1e5]))
    ground(far, tmp_path / "out.laz")
    found = np.asarray(laspy.read(tmp_path / "out.laz").classification)
    assert np.mean((found == PointClass.GROUND) == (truth == FLOOR)) > 0.98


def test_vault_alone_has_no_ground(tunnel: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    source, truth = tunnel
    las = laspy.read(source)
    xyz = np.asarray(las.xyz)
    vault = xyz[(truth == LINING) & (xyz[:, 2] > np.median(xyz[:, 2]) + 0.5)]
    text = ground(save(tmp_path / "vault.laz", vault), tmp_path / "out.laz")
    assert "no ground" in text
    found = np.asarray(laspy.read(tmp_path / "out.laz").classification)
    assert not (found == PointClass.GROUND).any()
    assert (found == PointClass.LINING).mean() > 0.9


def test_field_has_no_lining(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    field = rng.uniform([0, 0, -0.02], [40, 40, 0.02], (200_000, 3)) + ORIGIN
    text = ground(save(tmp_path / "field.laz", field), tmp_path / "out.laz")
    assert "no lining" in text
    found = np.asarray(laspy.read(tmp_path / "out.laz").classification)
    assert (found == PointClass.GROUND).mean() > 0.95


@pytest.mark.parametrize(
    ("xyz", "says"),
    [
        (np.empty((0, 3)), "holds no points"),
        (np.array([[1.0, 2.0, 3.0]]), "neither ground nor lining"),
        (np.tile([[1.0, 2.0, 3.0]], (1000, 1)), "neither ground nor lining"),
        (np.array([[0.0, 0.0, 0.0], [1.0e6, 0.0, 0.0]]), "voxels apart"),
        (np.random.default_rng(2).uniform(0, 50, (2000, 3)), "neither ground nor lining"),
    ],
    ids=["empty", "one point", "one place", "far apart", "dust"],
)
def test_what_is_no_tunnel_is_refused(xyz: np.ndarray, says: str, tmp_path: Path) -> None:
    assert says in ground(save(tmp_path / "in.laz", xyz), tmp_path / "out.laz", code=2)


def test_arguments(tmp_path: Path) -> None:
    source = save(tmp_path / "in.laz", ORIGIN + np.random.default_rng(1).random((10, 3)))
    before = source.read_bytes()
    assert "is the input file" in ground(source, source, code=2)
    (tmp_path / "link.laz").symlink_to(source)
    assert "is the input file" in ground(tmp_path / "link.laz", source, code=2)
    assert source.read_bytes() == before
    assert "extension .laz" in ground(source, tmp_path / "out.las", code=2)
    assert "no such file" in ground(tmp_path / "none.laz", tmp_path / "out.laz", code=2)
    assert "no parameter of this command" in ground(source, tmp_path / "out.laz", "--set", "section.angle_step=10", code=2)
    assert "out of bounds" in ground(source, tmp_path / "out.laz", "--set", "ground.voxel=-1", code=2)
    assert "no such folder" in _refused(source, tmp_path / "none" / "out.laz")


def _refused(source: Path, target: Path) -> str:
    result = CliRunner().invoke(main, ["ground", str(source), "-o", str(target)])
    assert result.exit_code == 2
    return result.output


def test_full_disk(tunnel: tuple[Path, np.ndarray], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def rewrite(source: Path, target: Path, *_: object) -> None:
        target.write_bytes(b"something")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(bare, "rewrite", rewrite)
    text = ground(tunnel[0], tmp_path / "out.laz", code=2)
    assert text == f"tunneldb: {tmp_path / 'out.laz'}: cannot be written: No space left on device\n"


SLOW = """
import time
from types import SimpleNamespace
import numpy as np
from tunneldb.cli.main import main
from tunneldb.export.pointcloud import single_file as bare

scene = SimpleNamespace(ground=0, clusters=[], relief=None, classes=lambda xyz: np.full(len(xyz), 2, np.uint8))
bare.find_scene_of = lambda *_: (scene, 0.0)
whole = bare.rewrite

def rewrite(*arguments):
    whole(*arguments)
    print("written", flush=True)
    time.sleep(60)

bare.rewrite = rewrite
main()
"""


@pytest.mark.parametrize("kill", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_killed_in_the_middle(tmp_path: Path, kill: signal.Signals) -> None:
    """Nothing appears under the name; but for a kill that nobody can notice, nothing is left at all."""
    source = save(tmp_path / "in.laz", ORIGIN + np.random.default_rng(1).random((1000, 3)))
    out = tmp_path / "out"
    out.mkdir()
    target = out / "out.laz"
    target.write_bytes(b"of a former run")
    command = [sys.executable, "-c", SLOW, "ground", str(source), "-o", str(target)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "written\n"
        os.kill(process.pid, kill)
        assert process.wait(30) != 0
    assert target.read_bytes() == b"of a former run"
    if kill != signal.SIGKILL:
        assert list(out.iterdir()) == [target]


def test_real_tunnel(tmp_path: Path) -> None:
    source = real_scan("ringo.laz")
    ground(source, tmp_path / "out.laz")
    counts = np.bincount(laspy.read(tmp_path / "out.laz").classification, minlength=256)
    assert counts.sum() == 1_139_889
    share = counts / counts.sum()
    # A floor of 9 m in a section with a perimeter of 28 m, seen from 2 m above it.
    assert 0.2 < share[PointClass.GROUND] < 0.6
    assert 0.3 < share[PointClass.LINING] < 0.8
