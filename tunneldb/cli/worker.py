"""`tunneldb worker` and `tunneldb stop`."""

from __future__ import annotations

import time

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import tell, verb
from tunneldb.database import connect


@verb(examples=["tunneldb worker --concurrency 8"])
@click.option("--concurrency", type=click.IntRange(1, 1000), default=1, show_default=True, metavar="N", help="Jobs at a time.")
@click.option(
    "--threads",
    type=click.IntRange(1, 1000),
    default=1,
    show_default=True,
    metavar="N",
    help="Threads that each computes with.",
)
@click.pass_obj
def worker(settings: Settings, concurrency: int, threads: int) -> None:
    """Do what batches ask for, of all surveys, until told to stop.

    A worker needs the database and the scan files, under the same paths as where the batch was called. A server that is away is
    waited for. Ctrl-C, SIGTERM and tunneldb stop let it end the stage that it is at; a second Ctrl-C ends it at once.
    """
    from tunneldb.job.team import Team, interrupts
    from tunneldb.job.worker import Orders

    connect(settings.dsn).close()
    team = Team(Orders(settings.dsn, threads), concurrency)
    with interrupts(team):
        team.start()
        while team.tend():
            time.sleep(0.2)


@verb(examples=["tunneldb stop --wait"])
@click.option("--wait", is_flag=True, help="Wait until all have left.")
@click.pass_obj
def stop(settings: Settings, wait: bool) -> None:
    """Ask all workers of the database to end the stages that they are at, and leave. What is wanted stays wanted."""
    with connect(settings.dsn) as conn:
        conn.autocommit = True
        conn.execute("SELECT tunnel_api.queue_rescue()")
        asked = conn.execute("UPDATE tunnel.worker SET stop = true RETURNING id").fetchall()
        tell(workers=len(asked))
        click.echo(f"{len(asked)} worker{'s' * (len(asked) != 1)} asked to stop")
        while wait and conn.execute("SELECT 1 FROM tunnel.worker WHERE id = ANY (%s)", [[row[0] for row in asked]]).fetchone():
            time.sleep(0.5)
            conn.execute("SELECT tunnel_api.queue_rescue()")
