"""The verb intensity on scan files by themselves."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main
from tunneldb.simulate import Parameters, Simulation, write


@pytest.fixture(scope="module")
def scan(tmp_path_factory) -> tuple[Path, list[str]]:
    """A scan of one station, and where it stood."""
    folder = tmp_path_factory.mktemp("scan")
    files = write(
        Simulation(Parameters(length=14, radius=0, station_spacing=14, angular_step=0.25, leaks=0, section="box", seed=2)),
        folder,
        truth=False,
    )
    station = np.loadtxt(files.poses, delimiter=",", skiprows=1)
    return files.clouds[0], [f"{v:.4f}" for v in station[1:]]


def _run(*arguments) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["intensity", *map(str, arguments)])
    return result.exit_code, result.output


def test_a_file_by_itself(scan, tmp_path):
    path, place = scan
    figure = tmp_path / "figure.png"
    code, says = _run(path, "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--scanner", *place, "-o", figure)
    assert code == 0, says
    assert "range" in says
    assert "dB/10°" in says
    assert "seen by several scans" in says
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--intensity-kind", "amplitude"], "--intensity DIMENSION"),
        (["--intensity", "Amplitude"], "--intensity-kind"),
        (["--intensity", "Amplitude", "--intensity-kind", "amplitude"], "give --scanner X Y Z"),
        (["--intensity", "Amplitud", "--intensity-kind", "amplitude", "--scanner", "0", "0", "0"], "no dimension 'Amplitud'"),
        (["--km", "3"], "--km is of a survey"),
        (["-o", "figure.doc"], ".png, .pdf, .svg"),
    ],
)
def test_nothing_is_guessed(scan, arguments, says):
    code, output = _run(scan[0], *arguments)
    assert code == 2
    assert says in output
    assert len(output.strip().splitlines()) == 1
