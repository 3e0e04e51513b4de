"""The command intensity on scan files by themselves, and surveys whose range curve is found on the lining."""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure

from tunneldb.cli.main import main
from tunneldb.export.figures import intensity_dependence
from tunneldb.radiometry.dependence import Dependence
from tunneldb.radiometry.diagnosis import Diagnosis
from tunneldb.radiometry.range_curve import MAX_SIGMA
from tunneldb.simulate import Parameters, Simulation, write
from tunneldb.simulate.radiometry import range_term

pytestmark = pytest.mark.slow


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
    words = [path, "-o", figure]
    for advised, values in (("--intensity", ["Amplitude"]), ("--intensity-kind", ["amplitude"]), ("--scanner", place)):
        code, says = _run(*words)
        assert (code, f"{advised} " in says) == (2, True), says
        words += [advised, *values]
    code, says = _run(*words)
    assert code == 0, says
    assert "range" in says
    assert "dB/10°" in says
    assert "seen by several scans" in says
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_the_title_lies_in_the_figure(tmp_path, monkeypatch):
    empty = np.zeros(0)
    kilometres = "pajares-2026, kilometre " + ", ".join(map(str, range(500, 560))) + ": amplitude"
    monkeypatch.setattr(Dependence, "verdict", lambda _: "Corrected intensity still depends on range and incidence. " * 5)
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: drawn.append(self))
    monkeypatch.setattr(intensity_dependence, "replacing", lambda path: nullcontext(path))
    intensity_dependence.write_figure(Diagnosis(kilometres, empty, empty, empty, empty), tmp_path / "a.png")
    (figure,) = drawn
    figure.canvas.draw()
    (title,) = [text for text in figure.texts if text.get_text().startswith("pajares")]
    extent = title.get_window_extent()
    assert extent.x0 >= 0.0
    assert extent.x1 <= figure.bbox.x1


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


@pytest.fixture(scope="module")
def stations(tmp_path_factory) -> Path:
    """A short tunnel seen from static stations."""
    folder = tmp_path_factory.mktemp("stations")
    write(
        Simulation(
            Parameters(name="auto", length=24, station_spacing=8, angular_step=0.25, leaks=2, start_chainage=1000, seed=3)
        ),
        folder,
    )
    return folder


def _tunneldb(*arguments, code=0) -> str:
    result = CliRunner().invoke(main, list(map(str, arguments)), catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result.stderr


def _add(folder: Path, dimension: str, kind: str, code: int = 0) -> str:
    _tunneldb("tunnel", "add", "auto", "--srid", 25830, "--axis", folder / "auto.axis.csv", "--start-chainage", 1000)
    return _tunneldb(
        "survey", "add", "auto", "--tunnel", "auto", "--date", "2024-05-04", "--stations", folder / "auto.stations.csv",
        "--intensity", dimension, "--intensity-kind", kind, "--reference", "auto", code=code,
    )  # fmt: skip


def test_detection_by_a_curve_found_on_the_lining(conn, stations):
    """It is kept, within its deviation of the simulator's, and a rerun puts it in place of the one before."""
    _add(stations, "Amplitude", "amplitude")
    _tunneldb("load", "auto", *sorted(stations.glob("*.laz")))
    coarse = "--set", "image.pixel=0.1"  # the curve is found on samples of the points
    _tunneldb("run", "auto", *coarse)
    curve = "SELECT range_m, intensity_db, sigma_db FROM tunnel_api.range_curve ORDER BY range_m"
    found = conn.execute(curve).fetchall()
    range_m, level, sigma = np.array(found, dtype=float).T
    there = np.isfinite(sigma)
    off = (level - range_term(range_m))[there]
    assert np.abs(off - off.mean()).max() < 0.3
    told = conn.execute("SELECT range_from, range_to, range_sigma FROM tunnel_api.radiometry").fetchone()
    assert told == pytest.approx((range_m[there].min(), range_m[there].max(), sigma[there].max()))
    assert told[2] <= MAX_SIGMA
    conn.execute("UPDATE tunnel.range_curve SET intensity_db = array_fill(7.0::float8, ARRAY[cardinality(range_m)])")
    conn.commit()
    _tunneldb("run", "auto", "--from", "detect", *coarse)
    np.testing.assert_allclose(np.array(conn.execute(curve).fetchall(), dtype=float), np.array(found, dtype=float))


def test_a_curve_that_the_maker_removed_is_not_sought(conn, stations):
    says = _add(stations, "Reflectance", "reflectance", code=2)
    assert "--reference auto is not needed" in says
    assert len(says.strip().splitlines()) == 1
    assert conn.execute("SELECT count(*) FROM tunnel.survey").fetchone() == (0,)
