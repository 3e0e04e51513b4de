"""A test that hangs, in Python or in native code, and a worker that dies, end the run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
ABORTS = "import os\ndef test_aborts():\n    os.abort()\n"
SLEEPS = "import time\ndef test_sleeps():\n    time.sleep(60)\n"
# As native code may: it keeps the interpreter's lock and returns at no signal, so that no handler and no thread of Python runs.
HOLDS = (
    "import ctypes, signal\ndef test_holds():\n"
    "    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])\n    ctypes.PyDLL(None).sleep(60)\n"
)
OTHERS = "import pytest\n@pytest.mark.parametrize('n', range(10))\ndef test_is_quick(n):\n    pass\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [(ABORTS, "crashed while running"), (SLEEPS, "Timeout (>1.0s)"), (HOLDS, "crashed while running")],
    ids=["a worker that dies", "a test that hangs", "native code that hangs"],
)
def test_the_run_ends(text: str, said: str, tmp_path: Path) -> None:
    for name in ("test_a.py", "test_b.py"):
        (tmp_path / name).write_text(text if name == "test_a.py" else OTHERS, encoding="utf-8")
    done = subprocess.run(
        [
            sys.executable, "-m", "pytest", "-c", ROOT / "pyproject.toml", "--rootdir", tmp_path, "-n", "2",
            "--dist", "loadgroup", "--timeout", "1", "-o", "faulthandler_timeout=3", "-p", "no:cacheprovider", tmp_path,
        ],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=100,
    )  # fmt: skip
    assert done.returncode == 1, done.stdout
    assert said in done.stdout, done.stdout
