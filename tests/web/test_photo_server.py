"""Photos at a server: several people at once, a server that is killed, long photos; nothing is lost that was shown as saved."""

from __future__ import annotations

import hashlib
import os
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2
import psycopg
import pytest
from support.photo_files import photo
from web.conftest import sign_in
from web.test_photos import PATH, rows
from web.test_serve import COMMAND

from tunneldb.report.pictures.load import load_pictures
from tunneldb.web import pictures
from tunneldb.web.security import MAX_PHOTO


def test_few_photos_are_decoded_at_once(server: Any, database: psycopg.Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three people send four photos each."""
    now, most, lock = 0, 0, threading.Lock()

    def counted(*arguments: Any) -> Any:
        nonlocal now, most
        with lock:
            now += 1
            most = max(most, now)
        try:
            return load_pictures(*arguments)
        finally:
            with lock:
                now -= 1

    monkeypatch.setattr(pictures, "load_pictures", counted)
    statuses: list[int] = []
    people = []
    for user in ("ines_web", "ivo_web", "olga_web"):
        browser = httpx2.Client(base_url=server.address, timeout=60)
        sign_in(browser, user)  # type: ignore[arg-type]
        browser.headers["X-CSRF-Token"] = csrf_of(browser)
        people.append(browser)
    threads = [
        threading.Thread(target=lambda b=b, n=n: statuses.append(b.post(PATH, content=photo(seed=n)).status_code))
        for n, b in enumerate(people * 4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert statuses == [201] * 12
    assert most == 2
    row = database.execute(
        "SELECT count(*), count(DISTINCT path) FROM tunnel_api.finding_photo WHERE finding_id = 1"
    ).fetchone()
    assert row == (12, 12)


def test_a_killed_server_leaves_no_half_photo_and_none_twice(
    logins: None, dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    """The server is killed between the file and its row; the same photo is sent again, as the page does."""
    with served(dsn, tmp_path) as (process, browser):
        conn.execute("LOCK TABLE tunnel.photo IN SHARE MODE")  # it can be read, and no row is written
        answers: list[object] = []
        thread = threading.Thread(target=lambda: answers.append(answered(browser, photo())))
        thread.start()
        wait_for(lambda: list(tmp_path.glob("*.jpg")))
        assert not answers
        process.kill()
        thread.join(30)
        assert answers == [None], "nothing was shown as saved"
    (file,) = tmp_path.iterdir()
    assert file.stem == hashlib.sha256(file.read_bytes()).hexdigest()
    assert {path for _, path, *_ in rows(conn)} <= {file.name}  # the database may still have done what it was asked for
    with served(dsn, tmp_path) as (process, browser):
        assert answered(browser, photo()) == 201
        assert [path for _, path, *_ in rows(conn)] == [file.name]
    assert list(tmp_path.iterdir()) == [file]


def test_a_server_that_is_killed_while_a_photo_comes_in_keeps_nothing(
    logins: None, dsn: str, example: str, conn: psycopg.Connection, tmp_path: Path
) -> None:
    content = photo()
    with (
        served(dsn, tmp_path) as (process, browser),
        socket.create_connection((browser.base_url.host, browser.base_url.port)) as slow,
    ):
        cookie = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
        slow.sendall(
            f"POST {PATH} HTTP/1.1\r\nHost: {browser.base_url.host}:{browser.base_url.port}\r\nCookie: {cookie}\r\n"
            f"X-CSRF-Token: {browser.headers['X-CSRF-Token']}\r\nContent-Length: {len(content)}\r\n\r\n".encode()
        )
        slow.sendall(content[: len(content) // 2])
        assert browser.get("/api/findings/1").status_code == 200  # one slow upload keeps nobody from working
        process.kill()
    assert (rows(conn), list(tmp_path.iterdir())) == ([], [])


def test_a_long_photo_is_refused_before_it_comes(server: Any) -> None:
    with socket.create_connection(("127.0.0.1", int(server.address.rpartition(":")[2]))) as connection:
        head = f"POST {PATH} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {MAX_PHOTO + 1}\r\n\r\n"
        connection.sendall(head.encode())
        connection.settimeout(20)
        assert connection.recv(100).startswith(b"HTTP/1.1 413 ")


@contextmanager
def served(dsn: str, folder: Path) -> Iterator[tuple[subprocess.Popen[str], httpx2.Client]]:
    """The command with a folder of photos, and a browser in which an inspector is signed in."""
    command = [*COMMAND, "--port", "0", "--photos", str(folder)]
    environment = {**os.environ, "TUNNELDB_DSN": dsn}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            assert process.stdout is not None
            address = process.stdout.readline().strip()
            with httpx2.Client(base_url=address, timeout=60) as browser:
                sign_in(browser, "ines_web")  # type: ignore[arg-type]
                browser.headers["X-CSRF-Token"] = csrf_of(browser)
                yield process, browser
        finally:
            process.kill()


def csrf_of(browser: Any) -> str:
    return str(browser.get("/").text.partition('name="csrf" content="')[2].partition('"')[0])


def answered(browser: httpx2.Client, content: bytes) -> int | None:
    """Return the status of an upload; None if no answer came."""
    try:
        return browser.post(PATH, content=content).status_code
    except httpx2.TransportError:
        return None


def wait_for(fits: Callable[[], object]) -> None:
    end = time.monotonic() + 30
    while not fits():
        assert time.monotonic() < end
        time.sleep(0.02)
