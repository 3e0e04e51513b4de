"""Verbs that are told to end by SIGTERM: no folder that they have made for nothing stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

SLOW = """
import time
from tunneldb.cli import simulate_canal
from tunneldb.cli.main import main

def simulate(*_):
    print("begun", flush=True)
    time.sleep(60)

simulate_canal.simulate = simulate
main()
"""


def test_a_folder_without_anything_is_taken_away(tmp_path: Path) -> None:
    command = [sys.executable, "-c", SLOW, "simulate-canal", str(tmp_path / "new" / "out")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        assert (tmp_path / "new" / "out").is_dir()
        os.kill(process.pid, signal.SIGTERM)
        assert process.wait(30) == 128 + signal.SIGTERM
    assert not list(tmp_path.iterdir())
