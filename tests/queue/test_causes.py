"""What is advised where something failed: each kind by the message that the program itself has for it."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import psycopg
import pytest
from pyproj import CRS

from tunneldb.cli.overview import Advice
from tunneldb.database.failures import describe_failure
from tunneldb.errors import BusyError, UserError
from tunneldb.pointcloud.reader import check_header, read_header
from tunneldb.pointcloud.spool import Spool
from tunneldb.queue.causes import CAUSES, DATA, PASSING, PROGRAM, cause_of
from tunneldb.stages.ledger import describe


def _scan(path: Path) -> Path:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_crs(CRS.from_epsg(25829))
    cloud = laspy.LasData(header)
    cloud.x = cloud.y = cloud.z = np.arange(10.0)
    cloud.write(path)
    return path


def _damaged(path: Path) -> Path:
    path.write_bytes(_scan(path).read_bytes()[:300])
    return path


def _full(error: type[psycopg.Error], text: str) -> Callable[[Path], None]:
    def fail(folder: Path) -> None:
        raise error(text)

    return fail


def _temporary(folder: Path) -> None:
    with pytest.MonkeyPatch.context() as patch, Spool(0) as spool:
        patch.setattr(tempfile, "TemporaryFile", lambda **_: Path("/dev/full").open("wb", buffering=0))  # noqa: SIM115
        spool._spill(_run())


def _run() -> object:
    class Run:
        rows = np.zeros(1000)
        start = np.array([0, 1000])

    return Run()


FAILURES: list[tuple[str, Callable[[Path], object]]] = [
    (
        "database full",
        _full(psycopg.errors.DiskFull, 'could not extend file "base/1/2": No space left on device\nCONTEXT:  COPY'),
    ),
    ("disk full", lambda folder: Path("/dev/full").write_bytes(b"x")),
    ("temporary folder full", _temporary),
    ("memory", _full(psycopg.errors.OutOfMemory, "out of memory")),
    ("memory", lambda folder: bytearray(1 << 60)),
    ("rights", _full(psycopg.errors.InsufficientPrivilege, "permission denied for table point")),
    ("password", _full(psycopg.OperationalError, 'FATAL:  password authentication failed for user "otto"')),
    ("file missing", lambda folder: read_header(folder / "gone.laz")),
    ("coordinate system", lambda folder: check_header(read_header(_scan(folder / "a.laz")), None, 25830, False)),
    ("intensity", lambda folder: check_header(read_header(_scan(folder / "a.laz")), "Amplitude", 25829, False)),
    ("file damaged", lambda folder: read_header(_damaged(folder / "a.laz"))),
    ("passing", _full(psycopg.errors.DeadlockDetected, "deadlock detected\nDETAIL:  Process 1")),
    ("passing", _full(psycopg.errors.LockNotAvailable, "canceling statement due to lock timeout")),
    ("passing", _full(psycopg.OperationalError, "server closed the connection unexpectedly\n\tThis probably means")),
    ("program", lambda folder: {}["km"]),
    ("data", lambda folder: _raise(UserError("too few points"))),
    ("passing", lambda folder: _raise(BusyError("another process is at work on kilometre 1: wait"))),
]


def _raise(error: Exception) -> None:
    raise error


@pytest.mark.parametrize(("name", "fail"), FAILURES)
def test_the_program_s_own_message_has_its_kind(name: str, fail: Callable[[Path], object], tmp_path: Path) -> None:
    with pytest.raises(Exception) as failed:  # noqa: PT011
        fail(tmp_path)
    message = describe(failed.value)
    assert "\n" not in message
    assert not any(word in message for word in ("CONTEXT", "DETAIL", "DiskFull"))
    assert cause_of(message).name == name, message


@pytest.mark.parametrize(("name", "says"), [
    ("data", "{path}: too few points"),
    ("file missing", "{path}: no such file"),
    ("coordinate system", "{path}: its coordinate system is EPSG:25829"),
    ("file of another tunnel", "kilometre 3 rests on {name}: {path}: 70 % of the points lie off the given axis"),
    ("file damaged", "{path}: truncated or corrupt: end of file"),
])  # fmt: skip
def test_how_a_file_is_called_says_nothing(name: str, says: str) -> None:
    path = "/data/is a folder/not  damaged/truncated, cannot be read/no such file.laz"
    message = describe(UserError(says.format(path=path, name=path.rsplit("/", 1)[1])))
    assert cause_of(message, [path]).name == name
    assert cause_of("/data/damaged.laz, line 3: 4 values, but 3 are named").name == "data"


def test_only_what_passes_is_tried_again_as_it_is() -> None:
    assert [cause.name for cause in (*CAUSES, DATA, PROGRAM) if not cause.first] == [PASSING.name]
    assert Advice((2,), "load: failed: a", "tunneldb batch s --retry-failed").line() == (
        "km 2: load: failed: a: tunneldb batch s --retry-failed"
    )
    full = Advice((), "a", "b", CAUSES[0].first).line()
    assert full == "a: first free space on the database's disk (tunneldb check says how much), then: b"


def test_a_full_disk_of_the_program_is_one_line_too() -> None:
    with pytest.raises(OSError, match="No space") as full, Path("/dev/full").open("wb", buffering=0) as file:
        file.write(b"x")
    assert (
        describe_failure(full.value)
        == "No space left on device; the current work was rolled back: free some space, and run it again"
    )
    assert describe_failure(io.UnsupportedOperation("seek")) is None
