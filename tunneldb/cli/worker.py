"""`tunneldb worker` and `tunneldb stop`."""

from __future__ import annotations

import platform
import time
from contextlib import suppress

import click
import psycopg

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import WholeRange
from tunneldb.cli.progress import bar
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.queue.watching import ask_workers_to_stop, count_jobs, server_time, workers_left


@command(examples=["tunneldb worker --concurrency 8"])
@click.option(
    "--concurrency", type=WholeRange(1, 1000), default=1, show_default=True, metavar="N", help="Number of parallel jobs."
)
@click.option(
    "--threads",
    type=WholeRange(1, 1000),
    default=1,
    show_default=True,
    metavar="N",
    help="Threads for each job.",
)
@click.pass_obj
def worker(settings: Settings, concurrency: int, threads: int) -> None:
    """Run queued jobs of all surveys until stopped.

    A worker needs the database, and the scan files under the same paths as the batch. It waits for an unreachable
    server. After Ctrl-C, SIGTERM or tunneldb stop it finishes the current stage; a second Ctrl-C ends it at once.
    """
    from tunneldb.queue.pool import WorkerPool, interrupts
    from tunneldb.queue.worker import Orders

    jobs = _Jobs(settings.dsn)
    team = WorkerPool(Orders(settings.dsn, threads), concurrency)
    with interrupts(team), bar("jobs") as progress:
        task = progress.add_task("jobs", total=None)
        team.start()
        looked = 0.0
        while team.tend():
            jobs.crew.update(member.process.pid for member in team.members)
            if not progress.disable and time.monotonic() - looked > 2.0:
                done, left = jobs.count()
                progress.update(task, completed=done, total=done + left or None)
                looked = time.monotonic()
            time.sleep(0.2)
    add_to_json(jobs=jobs.count()[0])


class _Jobs:
    """Number of jobs that some worker processes of this machine have done since the object was created."""

    def __init__(self, dsn: str | None) -> None:
        self.dsn = dsn
        self.crew: set[int] = set()
        self.seen = (0, 0)
        with connect(dsn) as conn:
            self.began = server_time(conn)

    def count(self) -> tuple[int, int]:
        """Return the jobs done, and those of the database that are ready or under way; as before when the server is away."""
        names = [f"{platform.node()}/{pid}" for pid in self.crew]
        with suppress(psycopg.OperationalError, UserError), connect(self.dsn) as conn:
            self.seen = count_jobs(conn, names, self.began)
        return self.seen


@command(examples=["tunneldb stop --wait"])
@click.option("--wait", is_flag=True, help="Wait until all have exited.")
@click.pass_obj
def stop(settings: Settings, wait: bool) -> None:
    """Ask all workers of the database to finish their current stage and exit. Goals are kept."""
    with connect(settings.dsn) as conn:
        conn.autocommit = True
        asked = ask_workers_to_stop(conn)
        add_to_json(workers=len(asked))
        click.echo(f"{len(asked)} worker{'s' * (len(asked) != 1)} asked to stop")
        while wait and workers_left(conn, asked):
            time.sleep(0.5)
