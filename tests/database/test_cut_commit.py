"""A connection that is cut in COMMIT: the work is saved, the program cannot know it, and says so; a repetition is refused."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner
from psycopg.conninfo import conninfo_to_dict, make_conninfo

from tunneldb.cli.main import main


@contextmanager
def cut_after_commit(dsn: str, *, arrives: bool) -> Iterator[str]:
    """DSN of a proxy that ends the connection at the COMMIT of the first rows, after or before the server got it."""
    words = conninfo_to_dict(dsn)

    def forward(source: socket.socket, target: socket.socket, watched: bool) -> None:
        with suppress(OSError):
            while data := source.recv(1 << 16):
                if watched and b"INSERT" in data:
                    wrote.set()
                if watched and wrote.is_set() and b"COMMIT" in data:
                    if arrives:
                        target.sendall(data)
                        done.wait(5.0)
                    for side in (source, target):
                        side.shutdown(socket.SHUT_RDWR)
                    return
                if not watched and wrote.is_set() and b"COMMIT" in data:  # the server's answer, which the client does not get
                    done.set()
                    continue
                target.sendall(data)

    def serve() -> None:
        with suppress(OSError):
            while True:
                client, _ = listening.accept()
                server = socket.socket(socket.AF_UNIX)
                server.connect(f"{words['host']}/.s.PGSQL.{words.get('port', 5432)}")
                for pair in ((client, server, True), (server, client, False)):
                    threading.Thread(target=forward, args=pair, daemon=True).start()

    wrote, done = threading.Event(), threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        threading.Thread(target=serve, daemon=True).start()
        yield make_conninfo(dsn, host="127.0.0.1", port=listening.getsockname()[1], sslmode="disable", gssencmode="disable")
        listening.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize("arrives", [True, False])
def test_what_was_cut_in_commit_is_whole_or_not_there(dsn: str, tmp_path: Path, arrives: bool) -> None:
    if not str(conninfo_to_dict(dsn).get("host", "")).startswith("/"):
        pytest.skip("the server has no Unix socket")
    axis = tmp_path / "axis.csv"
    axis.write_text("x,y,z\n272000,4765000,500\n272100,4765000,500\n")
    words = ["tunnel", "add", "cut", "--srid", "25830", "--axis", str(axis)]
    with cut_after_commit(dsn, arrives=arrives) as through:
        result = CliRunner().invoke(main, ["--dsn", through, *words])
    assert result.exit_code == 2, result.exception
    assert "the connection to the database broke" in result.stderr
    assert "saved whole or not at all: tunneldb status shows what is there" in result.stderr.splitlines()[-1]
    with psycopg.connect(dsn) as conn:
        there = conn.execute("SELECT count(*) FROM tunnel.tunnel").fetchone()
    again = CliRunner().invoke(main, ["--dsn", dsn, *words])
    assert again.exit_code == (2 if arrives else 0), again.stderr
    assert (there[0] > 0) == arrives  # type: ignore[index]
    assert CliRunner().invoke(main, ["--dsn", dsn, "status"]).exit_code == 0
