"""Scans of a tube from tripods, with wrong stations."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.pointcloud.merged_scans import find_merged, scanner_places
from tunneldb.pointcloud.station_fit import evenness, find_misfits

RADIUS, FLOOR = 3.0, -2.0  # m
STATIONS = np.array([[10.0, 0.3, -0.5], [30.0, -0.3, -0.5], [50.0, 0.3, -0.4]])
SCANS = np.array([1, 2, 3])


def scan(station: np.ndarray, low: float = -100.0, high: float = 200.0) -> np.ndarray:
    """Points of a scanner at even angles, to 30° from its nadir, on a tube along x with a floor, between two chainages."""
    azimuth, elevation = np.meshgrid(np.radians(np.arange(0.0, 360.0, 2.0)), np.radians(np.arange(-60.5, 89.0, 2.0)))
    flat = np.cos(elevation).ravel()
    ray = np.column_stack([flat * np.cos(azimuth.ravel()), flat * np.sin(azimuth.ravel()), np.sin(elevation).ravel()])
    a, b = np.maximum((ray[:, 1:] ** 2).sum(axis=1), 1e-9), ray[:, 1:] @ station[1:]
    range_ = (-b + np.sqrt(b * b - a * (station[1:] @ station[1:] - RADIUS**2))) / a
    range_ = np.minimum(range_, np.where(ray[:, 2] < 0.0, (FLOOR - station[2]) / np.minimum(ray[:, 2], -1e-9), np.inf))
    points = station + range_[:, None] * ray
    return points[(range_ < 60.0) & (points[:, 0] > low) & (points[:, 0] < high)]


def thin(points: np.ndarray, edge: float = 0.15) -> np.ndarray:
    return points[np.unique(np.floor(points / edge), axis=0, return_index=True)[1]]


def joined(parts: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate(parts), np.repeat(SCANS[: len(parts)], [len(part) for part in parts])


PARTS = [scan(station) for station in STATIONS]
THINNED = [thin(scan(station, station[0] - 8.0, station[0] + 8.0)) for station in STATIONS]


@pytest.mark.parametrize("parts", [PARTS, THINNED], ids=["whole", "thinned"])
def test_right_stations_fit(parts: list[np.ndarray]) -> None:
    assert find_misfits(*joined(parts), SCANS, STATIONS) == []


@pytest.mark.parametrize("parts", [PARTS, THINNED], ids=["whole", "thinned"])
def test_exchanged_numbers_are_found(parts: list[np.ndarray]) -> None:
    found = find_misfits(*joined(parts), SCANS, STATIONS[::-1])
    assert [(one.scan_id, one.station) for one in found] == [(1, 3), (3, 1)]
    assert [round(one.shift) for one in found] == [-40, 40]


@pytest.mark.parametrize("parts", [PARTS, THINNED], ids=["whole", "thinned"])
def test_stations_at_one_place_are_found(parts: list[np.ndarray]) -> None:
    found = find_misfits(*joined(parts), SCANS, np.repeat(STATIONS[:1], 3, axis=0))
    assert [one.scan_id for one in found] == [2, 3]


def test_a_single_scan_from_elsewhere_is_found() -> None:
    found = find_misfits(*joined(PARTS[:1]), SCANS[:1], STATIONS[:1] + np.array([4.0, 0.0, 0.0]))
    assert [round(one.shift) for one in found] == [-4]
    assert find_misfits(*joined(PARTS[:1]), SCANS[:1], STATIONS[:1] + np.array([1.0, 0.2, 0.3])) == []


@pytest.mark.parametrize(
    "points",
    [
        scan(STATIONS[0], 10.0),  # at a portal
        scan(STATIONS[0], 15.0),  # before it
        scan(STATIONS[0], 20.0, 40.0),  # a tile of the tunnel
        thin(scan(STATIONS[0], 10.0)),
        thin(scan(STATIONS[0], 5.0, 30.0)),
        thin(scan(STATIONS[0], 20.0, 40.0)),
    ],
    ids=["portal", "before", "tile", "portal thinned", "half thinned", "tile thinned"],
)
def test_parts_of_a_scan_are_no_fault(points: np.ndarray) -> None:
    assert find_misfits(*joined([points]), SCANS, STATIONS) == []


def test_two_scans_from_one_tripod_fit() -> None:
    assert find_misfits(*joined([PARTS[0], PARTS[0]]), SCANS[:2], STATIONS[[0, 0]]) == []


def test_stations_in_feet_are_found() -> None:
    assert [one.scan_id for one in find_misfits(*joined(PARTS), SCANS, STATIONS / 0.3048)] == [1, 2, 3]


def test_directions_are_even_from_the_station_only() -> None:
    whole, filled = evenness(PARTS[0], STATIONS[0])
    assert filled > 0.9
    assert all(evenness(PARTS[0], STATIONS[0] + np.array([shift, 0.0, 0.0]))[0] < whole for shift in (-6.0, -3.0, 3.0, 6.0))


def on_wall(points: np.ndarray, along: float) -> np.ndarray:
    """Points of the first scan, where a wall across the tunnel ends what the scanner sees."""
    away = points - STATIONS[0]
    hit = points[:, 0] > along
    out = points.copy()
    out[hit] = STATIONS[0] + away[hit] * ((along - STATIONS[0, 0]) / away[hit, :1])
    return out


@pytest.mark.parametrize(
    "points",
    [
        PARTS[0],
        thin(PARTS[0]),
        scan(STATIONS[0], 10.0),
        scan(STATIONS[0], 14.0, 40.0),
        on_wall(PARTS[0], 14.0),
        on_wall(PARTS[0], 18.0),
        np.concatenate([PARTS[0], PARTS[0] + [2.0, 0.0, 0.0]]),
    ],
    ids=["whole", "thinned", "portal", "tile", "face", "far face", "two near"],
)
def test_one_place_is_found_of_one_scan(points: np.ndarray) -> None:
    assert len(scanner_places(points[:, 0])) == 1


@pytest.mark.parametrize("parts", [PARTS, THINNED], ids=["whole", "thinned"])
def test_places_of_merged_scans_are_found(parts: list[np.ndarray]) -> None:
    points = np.concatenate(parts)
    (merged,) = find_merged(points[:, 0], np.ones(len(points), np.int64))
    np.testing.assert_allclose(merged.places, STATIONS[:, 0], atol=1.0)
    assert find_merged(*(array if k else array[:, 0] for k, array in enumerate(joined(parts)))) == []


@pytest.mark.parametrize(("every", "places"), [(3, 2), (8, 1)])
def test_a_place_has_a_fifth_of_the_points(every: int, places: int) -> None:
    points = np.concatenate([PARTS[0], PARTS[0][::every] + np.array([25.0, 0.0, 0.0])])
    assert len(scanner_places(points[:, 0])) == places
