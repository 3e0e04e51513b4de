"""The command for a shell's PATH, `bin/tunneldb`, from any folder; QGIS started from that shell has its own Python."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.qgis import ENVIRONMENT
from support.system import missing

from tunneldb import __version__

BIN = Path(__file__).parents[2] / "bin"
SYSTEM = "/usr/bin:/bin"


def test_the_launcher_runs_the_command_of_its_environment(tmp_path: Path) -> None:
    project = tmp_path / "project"
    shutil.copytree(BIN, project / "bin")
    (project / ".venv" / "bin").mkdir(parents=True)
    (project / ".venv" / "bin" / "tunneldb").symlink_to(Path(sys.executable).with_name("tunneldb"))
    link = tmp_path / "link"
    link.symlink_to(project / "bin" / "tunneldb")
    for command in (project / "bin" / "tunneldb", link):
        done = subprocess.run([command, "--version"], cwd="/", capture_output=True, text=True, check=True)
        assert __version__ in done.stdout


def test_no_other_program_comes_into_the_path() -> None:
    assert [path.name for path in BIN.iterdir()] == ["tunneldb"]


@pytest.mark.slow
def test_qgis_starts_with_python_from_such_a_shell(tmp_path: Path) -> None:
    done = _plugins(f"{BIN}:{SYSTEM}", tmp_path)
    assert "* processing" in done, done  # loaded, by Python


@pytest.mark.slow
def test_qgis_finds_no_modules_where_an_environment_comes_first(tmp_path: Path) -> None:
    """Why `.venv/bin` must not be in PATH: QGIS takes the first python3 for its own."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    assert "load SIP module" in _plugins(f"{tmp_path / 'venv' / 'bin'}:{SYSTEM}", tmp_path)


def _plugins(path: str, home: Path) -> str:
    # Debian's wrapper hands over an option that only the desktop has
    program = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
    if program is None:
        missing("qgis_process")
    environment = {name: value for name, value in ENVIRONMENT.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    environment |= {"PATH": path, "HOME": str(home), "QGIS_PREFIX_PATH": "/usr"}
    done = subprocess.run([program, "plugins"], env=environment, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr
