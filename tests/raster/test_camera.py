"""Projections of cameras: numbers worked out by hand from the definitions of ASTM E2807."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tunneldb.raster.placement.camera import Camera

UPRIGHT = np.eye(3)


def camera(projection: str, **changes) -> Camera:
    given = {
        "projection": projection, "columns": 3600, "rows": 1800, "pixel_width": np.radians(0.1),
        "pixel_height": np.radians(0.1), "focal": 1.0, "principal": (1800.0, 900.0), "rotation": UPRIGHT,
        "position": np.zeros(3),
    }  # fmt: skip
    return Camera(**{**given, **changes})


def one(found: tuple[np.ndarray, np.ndarray]) -> tuple[float, float]:
    return found[0][0], found[1][0]


@pytest.mark.parametrize(
    ("point", "pixel"),
    [
        ((5.0, 0.0, 0.0), (1800.0, 900.0)),  # ahead: the middle
        ((0.0, 5.0, 0.0), (900.0, 900.0)),  # to the left by 90°
        ((0.0, -5.0, 0.0), (2700.0, 900.0)),
        ((5.0, 0.0, 5.0), (1800.0, 450.0)),  # 45° up
        ((3.0, 3.0, -np.sqrt(18.0)), (1350.0, 1350.0)),  # 45° to the left, 45° down
    ],
)
def test_spherical(point, pixel) -> None:
    assert one(camera("spherical").project(np.array([point]))) == pytest.approx(pixel)


@pytest.mark.parametrize(
    ("point", "pixel"),
    [
        ((0.0, 0.0, -10.0), (500.0, 400.0)),
        ((1.0, 0.0, -10.0), (1000.0, 400.0)),  # 0.1 × 50 mm / 10 µm to the right
        ((0.0, 0.5, -10.0), (500.0, 150.0)),  # up
        ((0.0, 0.0, 10.0), (np.nan, np.nan)),  # behind
        ((20.0, 0.0, -10.0), (np.nan, np.nan)),  # beside the picture
    ],
)
def test_pinhole(point, pixel) -> None:
    pinhole = camera("pinhole", focal=0.05, pixel_width=1e-5, pixel_height=1e-5, principal=(500.0, 400.0))
    assert one(pinhole.project(np.array([point]))) == pytest.approx(pixel, nan_ok=True)
    assert pinhole.pixel_angle == pytest.approx(2e-4)


def test_cylindrical() -> None:
    """Rows are heights on a cylinder of the radius: 2 m up at 4 m is 0.5 m at a radius of 1 m."""
    cylindrical = camera("cylindrical", focal=1.0, pixel_height=0.001, principal=(0.0, 1000.0))
    assert one(cylindrical.project(np.array([[0.0, 4.0, 2.0]]))) == pytest.approx((900.0, 500.0))


def test_the_pose_turns_and_moves() -> None:
    """A camera that is turned to the left by 90° about the vertical has what was on the left in its middle."""
    turned = camera("spherical", rotation=Rotation.from_euler("z", 90, degrees=True).as_matrix(), position=np.array([1, 2, 3]))
    assert one(turned.project(np.array([[1.0, 7.0, 3.0]]))) == pytest.approx((1800.0, 900.0))
