"""Size, density and profiles of clouds whose truth is their making."""

from __future__ import annotations

import numpy as np
import pytest
from support.real_scans import real_scan

from tunneldb.arrays import Float
from tunneldb.pointcloud.contents import UniformSample, read_contents, read_near
from tunneldb.pointcloud.form import WINDOW, profile_spacing, surface_density, tunnel_form
from tunneldb.pointcloud.points import Raw

RADIUS = 4.0


def tube(along: Float, rng: np.random.Generator) -> Float:
    """A point on a level tunnel along (3, 4, 0) / 5, at a place of its own in the section, for each distance along."""
    angle = rng.uniform(-np.pi, np.pi, len(along))
    across, up = RADIUS * np.sin(angle), RADIUS * np.cos(angle)
    return np.column_stack([0.6 * along + 0.8 * across, 0.8 * along - 0.6 * across, 300.0 + up]) + np.array([5e5, 4e6, 0.0])


@pytest.mark.parametrize("density", [5.0, 50.0, 500.0])
@pytest.mark.parametrize("most", [5_000, 1_000_000])
def test_density_is_that_of_the_surface_however_small_the_share(density: float, most: int) -> None:
    rng = np.random.default_rng(3)
    xyz = tube(rng.uniform(0.0, 60.0, int(density * 2 * np.pi * RADIUS * 60.0)), rng)
    sample = UniformSample(most)
    for begin in range(0, len(xyz), 7_000):
        part = xyz[begin : begin + 7_000]
        sample.add(Raw(*part.T, np.ones(3), np.zeros(3), None, np.zeros(len(part)), None, None), begin)
    assert len(sample.xyz) <= 2 * most
    np.testing.assert_array_equal(sample.xyz, xyz[sample.numbers])
    low, median, high = surface_density(sample.xyz, sample.share)
    assert median == pytest.approx(density, rel=0.2)
    assert low < median < high


def test_size_of_a_tunnel() -> None:
    rng = np.random.default_rng(3)
    form = tunnel_form(tube(rng.uniform(0.0, 60.0, 50_000), rng))
    assert form is not None
    assert form.length == pytest.approx(60.0, abs=0.5)
    assert form.width == pytest.approx(2 * RADIUS, abs=0.1)
    assert form.height == pytest.approx(2 * RADIUS, abs=0.1)
    assert tunnel_form(np.zeros((50, 3))) is None


@pytest.mark.parametrize(("spacing", "within"), [(0.01, 1), (0.05, 5), (0.5, 5), (1.0, 9)])
def test_profiles_and_how_far_they_lie_apart(spacing: float, within: int) -> None:
    """Profiles of a mirror that turns while the trolley moves, not quite square to the tunnel, and with noise."""
    rng = np.random.default_rng(2)
    step = spacing / within  # of points along the section
    turn = np.arange(int(WINDOW / spacing * 2 * np.pi * RADIUS / step)) * step / RADIUS / (2 * np.pi)
    angle = 2 * np.pi * turn
    along = turn * spacing + 0.005 * RADIUS * np.sin(angle) + rng.normal(0.0, 0.02 * step, len(turn))
    radius = RADIUS + rng.normal(0.0, 0.003, len(turn))
    found = profile_spacing(along, radius * np.sin(angle), radius * np.cos(angle))
    assert found == pytest.approx(spacing, rel=0.1)


def test_a_scanner_that_stood_still_has_no_profiles() -> None:
    rng = np.random.default_rng(2)
    along, angle = rng.uniform(0.0, WINDOW, 50_000), rng.uniform(-np.pi, np.pi, 50_000)
    assert profile_spacing(along, RADIUS * np.sin(angle), RADIUS * np.cos(angle)) is None
    # two passes of a profiler that don't keep step
    twice = np.where(np.arange(50_000) % 2, np.round(along / 0.5) * 0.5, np.round(along / 0.37) * 0.37)
    assert profile_spacing(twice, RADIUS * np.sin(angle), RADIUS * np.cos(angle)) is None
    assert profile_spacing(along[:5], along[:5], along[:5]) is None
    assert profile_spacing(np.zeros(100), np.zeros(100), np.zeros(100)) is None


def test_a_real_tunnel() -> None:
    path = real_scan("ringo.laz")
    contents = read_contents(path)
    assert (contents.points, contents.times) == (1_139_889, (200_000.0, 200_123.5))
    form = tunnel_form(contents.xyz)
    assert form is not None
    assert form.length == pytest.approx(123.5, abs=1.0)
    along, _ = form.line.place(contents.xyz)
    near = np.abs(along - np.median(along)) < WINDOW / 2
    xyz = read_near(path, contents, near)
    at, across = form.line.place(xyz)
    inside = np.abs(at - np.median(along)) < WINDOW / 2
    assert profile_spacing(at[inside], across[inside], xyz[inside, 2]) == pytest.approx(0.5, abs=0.01)
