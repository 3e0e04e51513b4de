"""The command: prints one line, serves, and ends."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.cookiejar import CookieJar

import pytest
from psycopg.conninfo import make_conninfo
from support.command import errors_of
from web.conftest import PASSWORD

COMMAND = [sys.executable, "-c", "from tunneldb.cli.main import main; main()", "serve", "--no-open"]


@pytest.fixture
def served(server_dsn: str, dsn: str, example: str) -> Iterator[subprocess.Popen[str]]:
    """A desk at which people sign in with passwords."""
    process = subprocess.Popen(
        [*COMMAND, "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TUNNELDB_DSN": dsn},
    )
    yield process
    process.kill()
    process.wait()


def test_it_prints_its_address_and_ends_on_sigterm(served: subprocess.Popen[str]) -> None:
    assert served.stdout is not None
    address = served.stdout.readline().strip()
    assert address.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(address + "healthz", timeout=20) as answer:
        assert answer.read() == b"ok"
    with pytest.raises(urllib.error.HTTPError, match="401"):
        urllib.request.urlopen(address + "api/surveys", timeout=20)
    served.send_signal(signal.SIGTERM)
    out, err = served.communicate(timeout=30)
    assert (served.returncode, out, err) == (0, "", "")


def test_files_of_the_page_are_kept_by_browsers_and_nothing_else_is(served: subprocess.Popen[str]) -> None:
    """Each has the version in its path, so a browser need not ask again; the page itself names the present version."""
    assert served.stdout is not None
    address = served.stdout.readline().strip()
    with urllib.request.urlopen(address + "login", timeout=20) as answer:
        page = answer.read().decode()
        assert answer.headers["Cache-Control"] == "no-store"
    (script,) = re.findall(r'<script type="module" src="/([^"]+)"', page)
    with urllib.request.urlopen(address + script, timeout=20) as answer:
        assert "immutable" in answer.headers["Cache-Control"]
    with pytest.raises(urllib.error.HTTPError, match="404") as missing:
        urllib.request.urlopen(address + script.replace("login.js", "nothing.js"), timeout=20)
    assert missing.value.headers["Cache-Control"] == "no-store"


def test_the_role_of_the_desk_may_be_a_viewer(logins: None, dsn: str, example: str) -> None:
    environment = {**os.environ, "TUNNELDB_DSN": make_conninfo(dsn, user="viola_web", password=PASSWORD)}
    with subprocess.Popen([*COMMAND, "--port", "0"], stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        with urllib.request.urlopen(process.stdout.readline().strip() + "healthz", timeout=20) as answer:
            assert answer.read() == b"ok"
        process.terminate()


def test_the_database_may_be_an_option_of_the_command(dsn: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUNNELDB_DSN", make_conninfo(dsn, dbname="nothing"))
    assert "nothing" in errors_of("serve", "--no-open", code=2)
    assert "cannot connect" in errors_of("serve", "--no-open", "--dsn", make_conninfo(dsn, dbname="neither"), code=2)


def test_embedded_server_prints_a_token_that_lets_in(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "TUNNELDB_DSN"}
    subprocess.run([*COMMAND[:3], "init"], env=environment, check=True, capture_output=True)
    with subprocess.Popen([*COMMAND, "--port", "0"], stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        jar = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        with jar.open(address, timeout=20) as page:
            assert "tunneldb" in page.read().decode()
        root = address.partition("enter")[0]
        with jar.open(root + "api/surveys", timeout=20) as answer:
            assert answer.read() == b"[]"
        process.terminate()
        assert process.wait(30) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--host", "0.0.0.0"], "passwords would cross the network unencrypted"),
        (["--certificate", "pyproject.toml"], "--certificate and --key belong together"),
        (["--host", "192.0.2.1", "--behind-proxy"], "cannot listen on 192.0.2.1"),
        (["--host", "no such name", "--behind-proxy"], "cannot listen on no such name"),
        (["--certificate", "pyproject.toml", "--key", "pyproject.toml"], "not a certificate and its key"),
        (["--photos", "nowhere"], "--photos nowhere: there is no such folder; create it"),
        (["--photos", "pyproject.toml"], "--photos pyproject.toml: there is no such folder; create it"),
    ],
)
def test_wrong_options_get_one_line(dsn: str, words: list[str], said: str) -> None:
    assert said in errors_of("serve", "--no-open", *words, code=2)


def test_a_database_without_tunneldb_is_refused(empty_dsn: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUNNELDB_DSN", empty_dsn)
    assert "type tunneldb init" in errors_of("serve", "--no-open", code=2)


def test_embedded_server_is_for_this_machine_only(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TUNNELDB_DSN", raising=False)
    assert "for this machine only" in errors_of("serve", "--host", "0.0.0.0", code=2)


def test_embedded_server_is_not_for_a_proxy(installed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TUNNELDB_DSN", raising=False)
    assert "for this machine only" in errors_of("serve", "--behind-proxy", code=2)


IMPATIENT = "from tunneldb.cli.main import main; from tunneldb.web import protocol; protocol.FIRST_REQUEST = 1.0; main()"


def test_half_requests_are_closed(dsn: str, example: str) -> None:
    words = [sys.executable, "-c", IMPATIENT, *COMMAND[3:], "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env={**os.environ, "TUNNELDB_DSN": dsn}) as process:
        assert process.stdout is not None
        try:
            port = int(process.stdout.readline().strip().rstrip("/").rpartition(":")[2])
            with socket.create_connection(("127.0.0.1", port)) as slow:
                slow.sendall(b"GET / HT")
                slow.settimeout(20)
                assert slow.recv(100) == b""
        finally:
            process.terminate()


def test_taken_port(dsn: str, served: subprocess.Popen[str]) -> None:
    assert served.stdout is not None
    port = served.stdout.readline().strip().rstrip("/").rpartition(":")[2]
    assert f"cannot listen on 127.0.0.1, port {port}" in errors_of("serve", "--no-open", "--port", port, code=2)
