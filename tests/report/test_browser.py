"""The browser that prints a report: which is taken, and that it ends with what waits for it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tunneldb.errors import UserError
from tunneldb.report.pdf import find_browser


def program(path: Path, text: str = "#!/bin/sh\n") -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, "utf-8")
    path.chmod(0o755)
    return path


def test_a_snap_is_taken_by_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A script that starts one, as Ubuntu's, and a link to snap, as in /snap/bin: another browser, or what to do is said."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("TUNNELDB_BROWSER", raising=False)
    program(tmp_path / "chromium-browser", '#!/bin/sh\nexec /snap/bin/chromium "$@"\n')
    (tmp_path / "chromium").symlink_to(program(tmp_path / "bin" / "snap"))
    for name in ("chromium", "chromium-browser"):
        monkeypatch.setenv("TUNNELDB_BROWSER", name)
        with pytest.raises(UserError, match=f"{name} is a snap.*install Chrome.*TUNNELDB_BROWSER.*html"):
            find_browser()
    monkeypatch.delenv("TUNNELDB_BROWSER")
    with pytest.raises(UserError, match="is a snap"):
        find_browser()
    chrome = program(tmp_path / "google-chrome")
    assert find_browser() == str(chrome)


SLOW = "#!/bin/sh\nsleep 600 & echo $! > {pids}.new; mv {pids}.new {pids}; wait\n"
PRINT = """
import sys
from collections.abc import Callable
from pathlib import Path
from tunneldb.files import replacing, exit_on_sigterm
from tunneldb.report.pdf import print_pdf
with exit_on_sigterm(), replacing(Path(sys.argv[2])) as temporary:
    print_pdf(sys.argv[1], Path(sys.argv[2]), temporary)
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_with_what_waits_for_it(tmp_path: Path, number: signal.Signals) -> None:
    """Also what it has started itself; and no folder stays."""
    pids = tmp_path / "pids"
    slow = program(tmp_path / "slow", SLOW.format(pids=pids))
    out, temporary = tmp_path / "out", tmp_path / "tmp"
    out.mkdir()
    temporary.mkdir()
    command = [sys.executable, "-c", PRINT, str(slow), str(out / "r.pdf")]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, env=os.environ | {"TMPDIR": str(temporary)}) as process:
        until(pids.exists)
        os.kill(process.pid, number)
        assert process.wait(30) != 0
    child = int(pids.read_text())
    until(lambda: not alive(child))
    assert [*out.iterdir(), *temporary.iterdir()] == []


def until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
