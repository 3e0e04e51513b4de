"""Features of shapes whose measures are known."""

import numpy as np
import pytest

from tunneldb.anomalies.features import NAMES, measure_features, measure_regions
from tunneldb.anomalies.regions import Region, RegionProperties

PIXEL = 0.02


def measured(mask: np.ndarray, row: int = 0, **properties: float) -> dict[str, float]:
    filled = int(mask.sum())
    region = Region(PIXEL, 0, row, mask, filled, 4.0 * filled, 6.0, RegionProperties(sigma=0.5 * filled, **properties))
    return dict(zip(NAMES, measure_features(region).tolist(), strict=True))


def test_a_rectangle_fills_its_box_and_a_turned_one_the_turned_box():
    upright = measured(np.ones((50, 30), bool))
    assert upright["box"] == upright["turned_box"] == upright["corners"] == 1.0
    assert upright["area"] == pytest.approx(np.log(0.6))
    assert upright["contrast"] == pytest.approx(8.0)
    row, column = np.mgrid[:120, :120] - 59.5
    angle = np.radians(20.0)
    along, across = column * np.cos(angle) + row * np.sin(angle), row * np.cos(angle) - column * np.sin(angle)
    turned = measured((np.abs(along) < 45) & (np.abs(across) < 25))
    assert turned["turned_box"] > 0.93
    assert turned["box"] < 0.87


@pytest.mark.parametrize("right", [True, False])
def test_what_is_wide_above_and_narrow_below_tapers_on_either_side_of_the_crown(right):
    row, column = np.mgrid[:60, :60]
    falls = row if right else 59 - row  # on the right wall arcs grow downwards
    mask = np.abs(column - 30) <= 0.5 * (60 - falls)
    assert measured(mask, 40 if right else -140)["taper"] > 0.1
    assert measured(mask[::-1], 40 if right else -140)["taper"] < -0.1


def test_ragged_is_one_for_a_disc_but_for_its_pixels_and_grows_with_fingers():
    row, column = np.mgrid[:200, :200] - 99.5
    disc = np.hypot(row, column) < 90
    # The sides of a disc's pixels are 4/π as long as its circle.
    assert measured(disc)["ragged"] == pytest.approx(np.log(4 / np.pi), abs=0.02)
    assert measured(disc & (np.arange(200) % 20 < 10))["ragged"] > 1.0


def test_softness_and_brightness_of_the_rim_and_what_it_lies_at():
    found = measured(
        np.ones((40, 40), bool), steps=100, inside=400.0, outside=150.0, far_steps=50, far_outside=10.0, bright=25,
        perimeter=160, perimeter_off=40, off_above=16, floor=8, perimeter_recess=16, recess=160, sharp=60, straight=45,
        darkening_square=1600 * 17.0,
    )  # fmt: skip
    assert found["step"] == pytest.approx((4.0 - 1.5) / 4.0)
    assert found["far_step"] == pytest.approx((4.0 - 0.2) / 4.0)
    assert found["uneven"] == pytest.approx(1.0 / 4.0)
    assert found["bright_rim"] == 0.25
    assert (found["beside"], found["beneath"], found["foot"]) == (0.25, 0.1, 0.05)
    assert (found["recess"], found["recess_rim"]) == (0.1, 0.1)
    assert (found["straight"], found["sharp"]) == (0.75, 0.5)


def test_what_can_not_be_measured_is_unknown():
    found = measured(np.ones((4, 4), bool), perimeter=16, perimeter_off=16)
    assert np.isnan([found["step"], found["far_step"], found["straight"], found["bright_rim"], found["sharp"]]).all()


def _line(chainage: float, width: int = 3, drop: float = 4.0) -> Region:
    mask = np.ones((60, width), bool)
    return Region(PIXEL, round(chainage / PIXEL), 0, mask, 60 * width, drop * 60 * width, drop, RegionProperties(sigma=60.0))


def test_what_repeats_along_the_tunnel_is_alike() -> None:
    joints = [_line(1.5 * k) for k in range(9)]
    other = [_line(6.2, width=30), _line(6.4, drop=8.0), _line(40.0)]
    alike = measure_regions([*joints, *other])[:, NAMES.index("alike")]
    # Within 5 m are three to either side; four may be so by chance.
    np.testing.assert_allclose(alike[:9], np.log1p([0, 0, 1, 2, 2, 2, 1, 0, 0]))
    np.testing.assert_array_equal(alike[9:], 0.0)
    assert measure_regions([]).shape == (0, len(NAMES))
