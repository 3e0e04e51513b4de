"""Workers on two machines with addresses of their own: one is cut off from the database while at a stage.

A machine is a network namespace with a name of its own; a bridge is the switch that both and the server hang on.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator

import psycopg
import pytest
from faults.conftest import Survey
from faults.project import COMMAND, Project, differences, register, runs, state
from faults.waiting import done, wait_for
from support.system import missing

from tunneldb.database.server import DATABASE, Server

NUMBER = os.getpid() % 250
SERVER, MACHINES = f"10.213.{NUMBER}.1", {f"tda{NUMBER}": f"10.213.{NUMBER}.11", f"tdb{NUMBER}": f"10.213.{NUMBER}.12"}
BRIDGE = f"tds{NUMBER}"
OPERATOR, PASSWORD = "night_shift", "correct horse"


def ip(*words: str, check: bool = True) -> None:
    subprocess.run(["ip", *words], check=check, capture_output=True, text=True)


def cut(machine: str) -> None:
    """Pull a machine's cable: nobody is told."""
    ip("link", "set", f"{machine}p", "down")


def mend(machine: str) -> None:
    ip("link", "set", f"{machine}p", "up")


@pytest.fixture(scope="module")
def network() -> Iterator[None]:
    if os.geteuid() != 0 or shutil.which("ip") is None or shutil.which("unshare") is None:
        missing("network namespaces take root, ip (iproute2) and unshare (util-linux)")
    try:
        ip("link", "add", BRIDGE, "type", "bridge")
        ip("addr", "add", f"{SERVER}/24", "dev", BRIDGE)
        ip("link", "set", BRIDGE, "up")
        for machine, address in MACHINES.items():
            ip("netns", "add", machine)
            ip("link", "add", f"{machine}p", "type", "veth", "peer", "name", "eth0", "netns", machine)
            ip("link", "set", f"{machine}p", "master", BRIDGE, "up")
            ip("-n", machine, "addr", "add", f"{address}/24", "dev", "eth0")
            ip("-n", machine, "link", "set", "eth0", "up")
            ip("-n", machine, "link", "set", "lo", "up")
    except subprocess.CalledProcessError as error:
        _remove_network()
        missing(f"network namespaces: {error.stderr.strip()}")
    yield
    _remove_network()


def _remove_network() -> None:
    for machine in MACHINES:
        ip("netns", "del", machine, check=False)
        ip("link", "del", f"{machine}p", check=False)
    ip("link", "del", BRIDGE, check=False)


@pytest.fixture
def listening(survey: Survey, network: None) -> Iterator[Project]:
    """The server, listening to the network for as long as the test lasts, for an operator with a password."""
    project = survey.project
    cluster = project.home / "cluster"
    before = {name: (cluster / name).read_text() for name in ("postgresql.conf", "pg_hba.conf")}
    password = project.home / "pgpass"
    password.write_text(f"{SERVER}:5432:{DATABASE}:{OPERATOR}:{PASSWORD}\n")
    password.chmod(0o600)
    project.fresh()
    with project.connect() as conn:
        conn.execute(f"CREATE ROLE {OPERATOR} LOGIN PASSWORD '{PASSWORD}' IN ROLE tunnel_operator")
    added = {
        "postgresql.conf": f"\nlisten_addresses = '{SERVER}'\n",
        "pg_hba.conf": f"host {DATABASE} {OPERATOR} {SERVER}/24 scram-sha-256\n",
    }
    try:
        for name, lines in added.items():
            (cluster / name).write_text(before[name] + lines)
        _restart(project)
        yield project
    finally:
        for name, text in before.items():
            (cluster / name).write_text(text)
        _restart(project)


def _restart(project: Project) -> None:
    server = Server(project.home)
    server.stop()
    server.start()


def worker(project: Project, machine: str) -> subprocess.Popen[bytes]:
    """Start a worker on a machine."""
    dsn = f"host={SERVER} port=5432 dbname={DATABASE} user={OPERATOR}"
    inside = ["ip", "netns", "exec", machine, "unshare", "--uts", "sh", "-c", 'hostname "$0" && exec "$@"', machine]
    home = project.home / machine
    home.mkdir(exist_ok=True)
    environment = project.environment | {"PGPASSFILE": str(project.home / "pgpass"), "TUNNELDB_HOME": str(home)}
    with (project.home / "worker.log").open("ab") as output:
        return subprocess.Popen(
            [*inside, *COMMAND, "--dsn", dsn, "worker"],
            cwd=project.home, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
        )  # fmt: skip


def at_work(conn: psycopg.Connection, machine: str) -> tuple[int, int, str] | None:
    """Job, kilometre and stage that a machine is at."""
    return conn.execute(
        "SELECT r.job_id, r.km, r.stage FROM tunnel.run r JOIN tunnel_queue.procrastinate_jobs j ON j.id = r.job_id"
        " WHERE r.outcome = 'running' AND j.status = 'doing' AND r.worker LIKE %s || '/%%' AND r.km IS NOT NULL",
        [machine],
    ).fetchone()


def cut_at_work(project: Project, machine: str) -> tuple[int, int, str]:
    """Cut a machine off while it is at a stage, and make sure that it was in time."""
    with project.connect() as conn:
        while True:
            wait_for(project, lambda: at_work(conn, machine))
            cut(machine)
            time.sleep(0.5)  # what was under way to the server has come
            job = at_work(conn, machine)
            if job is not None:
                return job
            mend(machine)


def test_cut_off_machine_is_replaced_and_its_work_thrown_away(survey: Survey, listening: Project) -> None:
    first, second = MACHINES
    register(listening, survey.files)
    workers = {first: worker(listening, first)}
    try:
        job, km, stage = cut_at_work(listening, first)
        workers[second] = worker(listening, second)
        # Its heartbeat is missed, its session ended, and the other machine does its job, and all others.
        wait_for(listening, lambda: done(listening), workers[second])
        with listening.connect() as conn:
            by = conn.execute("SELECT worker FROM tunnel.run WHERE job_id = %s AND outcome = 'done'", [job]).fetchall()
            assert [row[0].split("/")[0] for row in by] == [second], (km, stage)
            addresses = conn.execute(
                "SELECT DISTINCT client_addr::text FROM pg_stat_activity WHERE usename = %s", [OPERATOR]
            ).fetchall()
            assert (f"{MACHINES[second]}/32",) in addresses
        # The link comes up again: the machine is there again, what it had done in the dark is not.
        mend(first)
        with listening.connect() as conn:
            wait_for(listening, lambda: _hosts(conn) == set(MACHINES), workers[first])
        listening.run("stop", "--wait")
        assert [process.wait(60) for process in workers.values()] == [0, 0]
    finally:
        for process in workers.values():
            if process.poll() is None:
                process.send_signal(signal.SIGKILL)
                process.wait()
    assert differences(survey.undisturbed, state(listening)) == []
    assert [row for row in runs(listening) if row[3] != 1] == []


def _hosts(conn: psycopg.Connection) -> set[str]:
    """Machines whose workers were heard of lately."""
    rows = conn.execute(
        "SELECT v.host FROM tunnel.worker v JOIN tunnel_queue.procrastinate_workers w ON w.id = v.id"
        " WHERE w.last_heartbeat > clock_timestamp() - interval '10 s'"
    ).fetchall()
    return {row[0] for row in rows}
