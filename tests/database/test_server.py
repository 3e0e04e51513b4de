"""The embedded server: it starts by itself, survives crashes, and keeps to itself."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest

from tunneldb.database import binaries, machine
from tunneldb.database.home import prepare_home
from tunneldb.database.server import Server
from tunneldb.errors import UserError

SETTINGS = {"fsync": "off", "shared_buffers": "32MB"}
as_root = pytest.mark.skipif(os.geteuid() != 0, reason="about root")


@pytest.fixture(scope="module")
def home() -> Iterator[Path]:
    yield from _temporary_home()


@pytest.fixture
def other_home() -> Iterator[Path]:
    yield from _temporary_home()


def _temporary_home() -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="tunneldb-server-"))
    yield folder
    Server(folder).stop()
    shutil.rmtree(folder, ignore_errors=True)


def query(dsn: str, statement: str) -> object:
    with psycopg.connect(dsn) as connection:
        cursor = connection.execute(statement)
        return cursor.fetchone()[0] if cursor.description else None


def postmaster(home: Path) -> int:
    return int((home / "cluster" / "postmaster.pid").read_text().split("\n")[0])


def kill_hard(home: Path) -> int:
    pid = postmaster(home)
    os.kill(pid, signal.SIGKILL)
    while Path(f"/proc/{pid}").exists():
        time.sleep(0.01)
    return pid


def test_it_listens_on_its_socket_only(home: Path) -> None:
    dsn = Server(home, SETTINGS).start()
    assert query(dsn, "SHOW listen_addresses") == ""
    assert query(dsn, "SELECT current_database()") == "tunneldb"
    assert query(dsn, "SELECT current_user") == pwd.getpwuid(os.geteuid()).pw_name
    assert query(dsn, "SHOW data_checksums") == "on"
    folder = prepare_home(home).run
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_copy_into_a_new_table_writes_next_to_no_wal(home: Path) -> None:
    with psycopg.connect(Server(home, SETTINGS).start()) as connection:
        before = connection.execute("SELECT pg_current_wal_insert_lsn()").fetchone()[0]
        connection.execute("CREATE TABLE bulk (n int8)")
        with connection.cursor().copy("COPY bulk FROM STDIN") as copy:
            for number in range(100_000):
                copy.write_row([number])
        connection.commit()
        written = connection.execute("SELECT pg_current_wal_insert_lsn() - %s::pg_lsn", [before]).fetchone()[0]
        size = connection.execute("SELECT pg_relation_size('bulk')").fetchone()[0]
    assert written < size / 10


def test_stopped_and_started_again_it_has_its_data(home: Path) -> None:
    server = Server(home, SETTINGS)
    query(server.start(), "CREATE TABLE kept AS SELECT 42 AS answer")
    assert server.stop()
    assert server.state() == "stopped"
    assert not server.stop()
    assert query(server.start(), "SELECT answer FROM kept") == 42


def test_it_survives_a_killed_first_process(home: Path) -> None:
    dsn = Server(home, SETTINGS).start()
    query(dsn, "CREATE TABLE committed AS SELECT 43 AS answer")
    idle = psycopg.connect(dsn)
    kill_hard(home)
    assert query(Server(home, SETTINGS).start(), "SELECT answer FROM committed") == 43
    idle.close()


def test_it_starts_while_an_orphan_of_the_crash_still_works(home: Path) -> None:
    dsn = Server(home, SETTINGS).start()
    # A loop that never waits does not notice that the first process is gone.
    loop = "DO $$ BEGIN FOR i IN 1..100000000 LOOP END LOOP; END $$"
    program = f"import psycopg; psycopg.connect({dsn!r}).execute({loop!r})"
    child = subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL)
    while not query(dsn, "SELECT count(*) FROM pg_stat_activity WHERE query LIKE 'DO %'"):
        time.sleep(0.05)
    kill_hard(home)
    assert query(Server(home, SETTINGS).start(), "SELECT 1") == 1
    child.wait()


def test_a_pid_that_went_to_another_program_does_not_stop_it(home: Path) -> None:
    Server(home, SETTINGS).start()
    pid = kill_hard(home)
    user = prepare_home(home).user
    stranger = subprocess.Popen(["sleep", "60"], cwd="/", user=None if user is None else user.pw_uid)
    try:
        pid_file = home / "cluster" / "postmaster.pid"
        pid_file.write_text(pid_file.read_text().replace(str(pid), str(stranger.pid), 1))
        assert query(Server(home, SETTINGS).start(), "SELECT 1") == 1
        assert stranger.poll() is None
    finally:
        stranger.kill()
        stranger.wait()


def test_two_homes_are_two_servers(home: Path, other_home: Path) -> None:
    one, other = Server(home, SETTINGS).start(), Server(other_home, SETTINGS).start()
    query(one, "CREATE TABLE mine AS SELECT 1")
    assert query(other, "SELECT to_regclass('mine') IS NULL") is True
    assert query(one, "SHOW data_directory") != query(other, "SHOW data_directory")


def test_two_programs_that_start_it_at_once_share_it_and_it_outlives_them(other_home: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from tunneldb.database.server import Server;"
        f"print(Server(Path(sys.argv[1]), {SETTINGS!r}).start())"
    )
    command = [sys.executable, "-c", program, str(other_home)]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    answers = [process.communicate()[0].strip() for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert answers[0] == answers[1]
    assert query(answers[0], "SELECT 1") == 1


def test_a_deep_folder_gets_a_short_socket_folder(other_home: Path) -> None:
    other_home.chmod(0o755)  # else root's server would have its state elsewhere, below a short path
    deep = other_home / "very-long-name-of-a-folder" / "another-one-below-it" / "a-third-that-is-long-too" / "and-the-last"
    server = Server(deep, SETTINGS)
    try:
        assert query(server.start(), "SELECT 1") == 1
        assert prepare_home(deep).state == deep
        run = prepare_home(deep).run
        assert not run.is_relative_to(deep)
        assert stat.S_IMODE(run.stat().st_mode) == 0o700
    finally:
        server.stop()
        shutil.rmtree(prepare_home(deep).run)


def test_a_socket_folder_of_somebody_else_is_refused(other_home: Path) -> None:
    (other_home / "run").symlink_to("/tmp")
    with pytest.raises(UserError, match="not a folder of the server's user"):
        Server(other_home, SETTINGS).start()


def test_a_socket_folder_that_stands_open_is_closed(other_home: Path) -> None:
    run = prepare_home(other_home).run
    run.chmod(0o777)
    prepare_home(other_home)
    assert stat.S_IMODE(run.stat().st_mode) == 0o700


@as_root
def test_a_start_that_was_killed_before_it_gave_a_folder_away_is_made_good(other_home: Path) -> None:
    (other_home / "run").mkdir(mode=0o700)
    home = prepare_home(other_home)
    assert home.user is not None
    assert (other_home / "run").stat().st_uid == home.user.pw_uid


@as_root
def test_root_drops_to_another_user(home: Path) -> None:
    Server(home, SETTINGS).start()
    assert Path(f"/proc/{postmaster(home)}").stat().st_uid == pwd.getpwnam("postgres").pw_uid


@as_root
def test_root_drops_to_the_owner_of_the_folder(other_home: Path) -> None:
    owner = pwd.getpwnam("nobody")
    os.chown(other_home, owner.pw_uid, owner.pw_gid)
    assert query(Server(other_home, SETTINGS).start(), "SELECT current_user") == "root"
    assert Path(f"/proc/{postmaster(other_home)}").stat().st_uid == owner.pw_uid


@as_root
def test_a_folder_that_only_root_may_enter_has_its_data_elsewhere(other_home: Path) -> None:
    (other_home / "closed").mkdir(mode=0o700)
    server = Server(other_home / "closed" / "home", SETTINGS)
    try:
        assert query(server.start(), "SELECT 1") == 1
        state = prepare_home(server.folder).state
        assert not state.is_relative_to(other_home)
        assert (server.folder / "cluster").resolve() == state / "cluster"
    finally:
        server.stop()
        shutil.rmtree(prepare_home(server.folder).state)


def test_without_postgresql_it_names_the_command_that_installs_it(other_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(binaries, "_FOLDERS", ())
    monkeypatch.setenv("PATH", "")
    binaries.find_binaries.cache_clear()
    with pytest.raises(UserError, match="sudo apt install postgresql-15-postgis-3"):
        Server(other_home).start()
    binaries.find_binaries.cache_clear()


def test_a_setting_that_postgresql_refuses_is_reported(other_home: Path) -> None:
    with pytest.raises(UserError, match=r"does not start: .*shared_buffers.*server\.log"):
        Server(other_home, {"shared_buffers": "'nonsense'"}).start()
    assert query(Server(other_home, SETTINGS).start(), "SELECT 1") == 1


@pytest.mark.parametrize("gib", [0.5, 2, 16, 512])
def test_settings_fit_the_machine(monkeypatch: pytest.MonkeyPatch, gib: float) -> None:
    monkeypatch.setattr(machine, "memory_bytes", lambda: int(gib * 1024**3))
    settings = machine.settings(Path("/run"))
    buffers, work = (int(settings[name].removesuffix("MB")) for name in ("shared_buffers", "work_mem"))
    assert 128 <= buffers <= max(128, gib * 1024 / 4)
    assert 16 <= work <= 256
