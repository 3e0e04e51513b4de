"""A PostgreSQL of the tests' own: the embedded server itself, in a folder that goes away with the session.

Each test that asks for `dsn` or `conn` gets a database as if fresh, copied from a template that is migrated and
installed once a session (see support/databases.py). With pytest-xdist each worker has its own server.
"""

from __future__ import annotations

import gc
import shutil
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest
from psycopg.conninfo import make_conninfo
from support import blas  # noqa: F401
from support.databases import SETTINGS as DATABASES
from support.databases import Copies, create_database
from support.system import memory_disk, missing

from tunneldb.database import connect, install, open_connection
from tunneldb.database.server import Server
from tunneldb.stages.registry import REGISTRY

pytest_plugins = ["support.example_survey"]

TEMPLATE = "tunneldb_template"
# Nothing of value is in it: no need to wait for the disk, and small enough for two workers on a small machine.
TEST_SETTINGS = {
    "fsync": "off",
    "synchronous_commit": "off",
    "full_page_writes": "off",
    "shared_buffers": "128MB",
    "max_wal_size": "256MB",
} | DATABASES

gc.set_threshold(100_000, 50, 1000)  # what tests make is soon gone by itself: looking for it took a twentieth of their time

# What a script runs in the background has Ctrl-C ignored, and so would all that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)


LONG = ("faults", "report", "qgis", "pipeline", "queue", "simulate", "classification")
"""Folders whose tests take longest, in the order in which they begin: the last tests of a run are short ones."""

SHARED = "survey"
"""Fixture of the fault tests that takes a minute to make: what asks for it runs on one worker, whatever its module."""


@pytest.hookimpl(wrapper=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Mark the tests that need a server, by whatever fixture, and say which run on one worker, and in which order."""
    for item in items:
        fixtures = getattr(item, "fixturenames", ())
        if "server_dsn" in fixtures or item.path.parent.name == "faults" or item.path.name == "test_server.py":
            item.add_marker("server")
        group = SHARED if SHARED in fixtures and "faults" in item.path.parts else item.path.name
        item.add_marker(pytest.mark.xdist_group(f"{item.path.parent.name}/{group}"))
    place = {name: n for n, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.path.parent.name, len(LONG)))
    yield


@pytest.fixture(scope="session", autouse=True)
def _own_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Keep every test away from the user's own embedded server and database."""
    home = Path(tempfile.mkdtemp(prefix="tunneldb-tests-", dir=memory_disk()))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TUNNELDB_HOME", str(home))
        patch.delenv("TUNNELDB_DSN", raising=False)
        yield home
    Server(home).stop()
    shutil.rmtree(home, ignore_errors=True)


@pytest.fixture(scope="session")
def chromium() -> Path:
    """Chromium, in which pages are looked at; without it their tests are skipped, but fail where CI=true, as in .ci/run."""
    path = Path("/usr/bin/chromium")
    if not path.exists():
        missing("Chromium")
    return path


@pytest.fixture(scope="session")
def server_dsn(_own_home: Path) -> str:
    """DSN of the embedded server's own database; started on first use."""
    return Server(_own_home, settings=TEST_SETTINGS).start()


@pytest.fixture(scope="session")
def installed(server_dsn: str) -> str:
    """Name of the database that is migrated and installed, and holds nothing else."""
    create_database(server_dsn, TEMPLATE)
    with open_connection(make_conninfo(server_dsn, dbname=TEMPLATE)) as connection:
        install(connection, REGISTRY)
    return TEMPLATE


@pytest.fixture(scope="session")
def template(installed: str) -> str:
    """Name of the database of which tests get copies; modules have others."""
    return installed


@pytest.fixture(scope="session")
def copies(server_dsn: str) -> Copies:
    """Copies of templates."""
    return Copies(server_dsn)


@pytest.fixture
def empty_dsn(copies: Copies) -> Iterator[str]:
    """DSN of a fresh database without anything in it, not even PostGIS."""
    with copies.copy("template0") as dsn:
        yield dsn


@pytest.fixture
def dsn(request: pytest.FixtureRequest, copies: Copies, template: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """DSN of a fresh, installed database; also in TUNNELDB_DSN, for commands.

    It holds the example survey when the test asks for `example` (see support/example_survey.py).
    """
    source = request.getfixturevalue("example_template") if "example" in request.fixturenames else template
    with copies.copy(source) as fresh:
        monkeypatch.setenv("TUNNELDB_DSN", fresh)
        yield fresh


@pytest.fixture
def conn(dsn: str) -> Iterator[psycopg.Connection]:
    """Connection to a fresh, installed database; not in autocommit. What the test does not commit is rolled back."""
    with connect(dsn) as connection:
        yield connection
        if not connection.closed:
            connection.rollback()
