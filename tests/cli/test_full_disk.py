"""Output onto a disk that is full: one line, exit code 2, nothing left of it, and what was there before as it was."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psycopg
import pytest
from click.testing import CliRunner
from pyogrio.errors import FeatureError
from support.system import missing

from tunneldb.cli.main import main
from tunneldb.database.server import Server
from tunneldb.errors import UserError
from tunneldb.files import made_folder, replacing
from tunneldb.simulate import Parameters, Simulation, write

KEPT = b"what was there before"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


class SmallDisk:
    """A disk in memory with so much room."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def resize(self, kilobytes: int) -> None:
        subprocess.run(["mount", "-o", f"remount,size={kilobytes}k", str(self.folder)], check=True)

    def files(self) -> list[str]:
        return sorted(str(path.relative_to(self.folder)) for path in self.folder.rglob("*"))


@pytest.fixture
def disk() -> Iterator[SmallDisk]:
    folder = Path(tempfile.mkdtemp(prefix="tunneldb-disk-"))  # which a server's own user may enter, other than pytest's
    command = ["mount", "-t", "tmpfs", "-o", "size=12k", "tmpfs", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode:
        folder.rmdir()
        missing("the right to mount a disk")
    yield SmallDisk(folder)
    subprocess.run(["umount", "--lazy", str(folder)], check=True)  # a traceback may hold an open file
    folder.rmdir()


@pytest.mark.parametrize(
    "words",
    [
        ["leaks", "demo-2024", "-o", "{disk}/kept.gpkg"],
        ["findings", "list", "demo-2024", "-o", "{disk}/kept.xlsx"],
        ["export", "demo-2024", "-o", "{disk}/kept.gpkg"],
        ["export", "demo-2024", "-o", "{disk}/kept.dxf"],
        ["survey", "export", "demo-2024", "-o", "{disk}/kept.tdb"],
        ["image", "demo-2024", "-o", "{disk}/images"],
        ["qgis", "demo-2024", "-o", "{disk}/kept.qgz"],
        ["report", "demo-2024", "--from", "12310", "--to", "12320", "-o", "{disk}/kept.html"],
        ["simulate", "{disk}/sim", "--length", "10", "--density", "5"],
        ["simulate-structure", "{disk}/sim", "--stations", "1", "--angular-step", "1"],
    ],
    ids=lambda words: f"{words[0]} {Path(words[-1]).suffix}" if isinstance(words, list) else None,
)
def test_output_is_whole_or_as_it_was(disk: SmallDisk, example: str, words: list[str]) -> None:
    kept = disk.folder / next((Path(word).name for word in words if "kept" in word), "kept.csv")
    kept.write_bytes(KEPT)
    result = CliRunner().invoke(main, [word.format(disk=disk.folder) for word in words])
    assert result.exit_code == 2, result.exception
    (line,) = (line for line in result.stderr.splitlines() if line.startswith("tunneldb: "))
    assert "No space left on device" in line
    assert line == result.stderr.splitlines()[-1]
    assert disk.files() == [kept.name]
    assert kept.read_bytes() == KEPT


def test_a_figure_is_whole_or_as_it_was(disk: SmallDisk, tmp_path: Path) -> None:
    """Writers of figures compress, and their compressors have errors of their own after a failed write."""
    shape = Parameters(length=14, radius=0, station_spacing=14, angular_step=0.5, leaks=0, section="box", seed=2)
    scan = write(Simulation(shape), tmp_path, truth=False)
    place = [f"{value:.4f}" for value in np.loadtxt(scan.poses, delimiter=",", skiprows=1)[1:]]
    words = ["intensity", str(scan.clouds[0]), "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--scanner", *place]
    for suffix in (".pdf", ".png"):
        kept = disk.folder / f"kept{suffix}"
        kept.write_bytes(KEPT)
        result = CliRunner().invoke(main, [*words, "-o", str(kept)])
        assert result.exit_code == 2, result.exception
        assert "No space left on device" in result.stderr.splitlines()[-1]
        assert disk.files() == [kept.name]
        assert kept.read_bytes() == KEPT
        kept.unlink()


def test_with_room_the_same_command_succeeds(disk: SmallDisk, example: str) -> None:
    command = ["leaks", example, "-o", str(disk.folder / "leaks.gpkg")]
    assert CliRunner().invoke(main, command).exit_code == 2
    disk.resize(4096)
    assert CliRunner().invoke(main, command).exit_code == 0
    assert disk.files() == ["leaks.gpkg"]


def test_an_archive_is_whole_or_nothing_wherever_the_disk_ends(disk: SmallDisk, example: str, conn: psycopg.Connection) -> None:
    """Also in the middle of a COPY, whose rollback would wait for its own end; locks are released each time."""
    command = ["survey", "export", example, "-o", str(disk.folder / "kept.tdb")]
    disk.resize(64 * 1024)
    assert CliRunner().invoke(main, command).exit_code == 0
    whole = (disk.folder / "kept.tdb").stat().st_size
    (disk.folder / "kept.tdb").unlink()
    for share in (0.2, 0.5, 0.8, 0.97):
        disk.resize(max(8, int(share * whole / 1024)))
        result = CliRunner().invoke(main, command)
        assert result.exit_code == 2, result.exception
        assert "No space left on device" in result.stderr.splitlines()[-1]
        assert disk.files() == []
        assert conn.execute("SELECT count(*) FROM pg_locks WHERE locktype = 'advisory'").fetchone() == (0,)
        conn.rollback()
    disk.resize(64 * 1024)
    assert CliRunner().invoke(main, command).exit_code == 0


@pytest.mark.server
def test_the_embedded_server_says_so_and_is_whole_with_room(disk: SmallDisk, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without room for the cluster, for WAL, and for rows."""
    home = disk.folder / "home"
    monkeypatch.setenv("TUNNELDB_HOME", str(home))
    monkeypatch.delenv("TUNNELDB_DSN", raising=False)

    def init() -> str:
        result = CliRunner().invoke(main, ["init"])
        assert result.exit_code == 2, result.exception
        (line,) = result.stderr.splitlines()
        return line

    try:
        disk.resize(20 * 1024)
        assert "initdb failed" in (said := init())
        assert "No space left on device" in said
        disk.resize(50 * 1024)
        said = init()  # whether WAL or a table meets the end of the room depends on how much WAL the server keeps ready
        down = "the server went down" in said or "the embedded server does not start" in said
        assert (down and "No space left on device" in said) or "the database's disk is full" in said
        disk.resize(300 * 1024)
        assert CliRunner().invoke(main, ["init"]).exit_code == 0
        axis = disk.folder / "axis.csv"
        axis.write_text("x,y,z\n0,0,0\n100,0,0\n")
        add = ["tunnel", "add", "t", "--srid", "25830", "--axis", str(axis)]
        with psycopg.connect(Server(home).start(), autocommit=True) as conn:
            conn.execute("CREATE TABLE grown (filler text)")
            free = shutil.disk_usage(disk.folder).free
            (disk.folder / "filler").write_bytes(bytes(free - (2 << 20)))
            with pytest.raises(psycopg.errors.DiskFull):
                conn.execute("INSERT INTO grown SELECT repeat(md5(n::text), 200) FROM generate_series(1, 100000) n")
            (disk.folder / "filler").unlink()
        # If WAL met the end of the room as well, the server is starting again: it gives a new connection.
        with psycopg.connect(Server(home).start(), autocommit=True) as conn:
            assert conn.execute("SELECT count(*) FROM grown").fetchone() == (0,)
        assert CliRunner().invoke(main, add).exit_code == 0
        assert CliRunner().invoke(main, ["check"]).exit_code in (0, 1)
    finally:
        Server(home).stop()


def test_a_library_that_says_it_in_its_own_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the right to mount: what is written goes to /dev/full, and the library's error says nothing of the disk."""
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **_: Path("/dev/full").open("wb", buffering=0))  # noqa: SIM115
    path = tmp_path / "old.gpkg"
    path.write_bytes(KEPT)
    with pytest.raises(UserError, match=r"old\.gpkg: cannot be written: No space left on device"), replacing(path):
        raise FeatureError("Could not add feature to layer at index 0")
    monkeypatch.undo()
    with pytest.raises(FeatureError), replacing(path):  # with room it is a fault of the program, and none is hidden
        raise FeatureError("Could not add feature to layer at index 0")
    assert [path.name for path in tmp_path.iterdir()] == ["old.gpkg"]
    assert path.read_bytes() == KEPT


def test_folders_made_for_nothing_are_taken_away(tmp_path: Path) -> None:
    with pytest.raises(KeyError), made_folder(tmp_path / "a" / "b"):
        raise KeyError
    assert not (tmp_path / "a").exists()
    with pytest.raises(KeyError), made_folder(tmp_path / "a" / "b"):
        (tmp_path / "a" / "b" / "whole.tif").touch()
        raise KeyError
    assert (tmp_path / "a" / "b" / "whole.tif").exists()
    with (
        pytest.raises(UserError, match="the folder cannot be made: File name too long"),
        made_folder(tmp_path / "c" / ("d" * 256)),
    ):
        raise AssertionError
    assert not (tmp_path / "c").exists()
