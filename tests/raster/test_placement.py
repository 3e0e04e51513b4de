"""Images of other instruments: placed in the unrolled plane, checked, and resampled into blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from affine import Affine

from tunneldb.errors import InputError
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import Grid
from tunneldb.raster.placement.checks import Lining, check_fit, check_placement, scale_error
from tunneldb.raster.placement.control import fit_control
from tunneldb.raster.placement.mapping import AffineMapping, Mapping, PiecewiseMapping, inverse
from tunneldb.raster.placement.resample import Frame, resample, usual_pixel

LINING = Lining(12300.0, 12380.0, -9.0, 9.0)
SPOTS = [(12305.0, 2.0), (12320.3, -6.2), (12333.7, 7.1), (12349.9, 0.4), (12361.2, -3.3), (12376.5, 5.0)]
"""Hot spots on the lining, chainage and arc, m: their places are known, whatever the image is."""


@dataclass(frozen=True)
class Pixels:
    """Source image in memory, (bands, rows, columns)."""

    values: np.ndarray

    @property
    def bands(self) -> int:
        return self.values.shape[0]

    @property
    def rows(self) -> int:
        return self.values.shape[1]

    @property
    def columns(self) -> int:
        return self.values.shape[2]

    def read(self, columns: slice, rows: slice, factor: int) -> np.ndarray:
        part = self.values[:, rows, columns]
        if factor == 1:
            return part
        bands, height, width = part.shape
        high, wide = (-(-n // factor) * factor for n in (height, width))
        padded = np.full((bands, high, wide), np.nan, np.float32)
        padded[:, :height, :width] = part
        return np.nanmean(padded.reshape(bands, high // factor, factor, wide // factor, factor), axis=(2, 4)).astype(np.float32)


def temperature(chainage: np.ndarray, arc: np.ndarray) -> np.ndarray:
    """Temperature of the lining, °C: hot spots of 0.15 m on 10 °C."""
    out = np.full(np.broadcast_shapes(chainage.shape, arc.shape), 10.0)
    for x, y in SPOTS:
        out += 8.0 * np.exp(-((chainage - x) ** 2 + (arc - y) ** 2) / (2 * 0.15**2))
    return out


def picture(place: Mapping, columns: int, rows: int) -> Pixels:
    """Image of the temperature by an instrument whose pixels are at known places."""
    column, row = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    return Pixels(temperature(*place.forward(column, row))[None].astype(np.float32))


def found_spots(blocks: list[tuple[int, Raster]]) -> np.ndarray:
    """Places of the hot spots in resampled blocks, by the centre of what is above 11 °C within 0.6 m."""
    out = []
    for x, y in SPOTS:
        total, weight = np.zeros(2), 0.0
        for _, raster in blocks:
            chainage, arc = raster.places()
            near = np.ix_(abs(arc - y) < 0.6, abs(chainage - x) < 0.6)
            above = np.maximum(np.nan_to_num(raster.values[near], nan=10.0) - 11.0, 0.0)
            total += [(above.sum(axis=0) * chainage[near[1][0]]).sum(), (above.sum(axis=1) * arc[near[0][:, 0]]).sum()]
            weight += above.sum()
        out.append(total / weight)
    return np.array(out)


TRUE = AffineMapping(Affine(0.02, 0, 12300.0, 0, -0.02, 9.0))
LONG = AffineMapping(Affine(0.02 / 1.02, 0, 12300.05, 0, -0.02, 9.05))
"""A strip whose own scale makes it 2 % too long and 5 cm off: pixels that it states as 20 mm are 19.6 mm."""

CONTROL = np.array(
    [[50.0, 60.0], [60.0, 850.0], [1400.0, 100.0], [2000.0, 800.0], [3300.0, 450.0], [4000.0, 70.0], [3990.0, 860.0]]
)


def control_places(place: Mapping, pixels: np.ndarray = CONTROL, noise: float = 0.005) -> np.ndarray:
    exact = np.column_stack(place.forward(pixels[:, 0], pixels[:, 1]))
    return exact + np.random.default_rng(3).normal(0.0, noise, exact.shape)


def test_a_strip_that_is_too_long_and_off_is_placed_within_two_centimetres() -> None:
    strip = picture(LONG, 4080, 900)
    fit = fit_control(CONTROL, control_places(LONG))
    assert fit.model == "affine"
    assert not fit.outliers.any()
    blocks = list(resample([Frame(strip, fit.mapping)], Grid.covering(12, 0.02, -9.0, 9.0)))
    assert [number for number, _ in blocks] == [246, 247]
    assert np.abs(found_spots(blocks) - SPOTS).max() < 0.02
    # by its own coordinates it is not
    own = list(
        resample([Frame(strip, AffineMapping(Affine(0.02, 0, 12300.0, 0, -0.02, 9.0)))], Grid.covering(12, 0.02, -9.0, 9.0))
    )
    assert np.abs(temperature(*np.array(SPOTS[-1:]).T) - 18.0) < 0.01
    chainage, arc = own[1][1].places()
    near = own[1][1].values[np.argmin(abs(arc - 5.0)), np.argmin(abs(chainage - 12376.5))]
    assert near < 11.0
    scale, along, around = scale_error(TRUE, fit.mapping, 4080, 900)
    assert scale == pytest.approx(0.02, abs=5e-4)
    assert (along, around) == (pytest.approx(-0.05, abs=0.01), pytest.approx(-0.05, abs=0.01))


def test_values_are_those_of_the_image() -> None:
    strip = picture(LONG, 4080, 900)
    for number, raster in resample([Frame(strip, LONG)], Grid.covering(12, 0.01, -9.0, 9.0)):
        chainage, arc = raster.places()
        assert raster.transform.c == number * 50.0
        true = temperature(chainage[None, :], arc[:, None])
        held = np.isfinite(raster.values)
        assert np.abs(raster.values - true)[held].max() < 0.05
        inside = (chainage > 12300.07) & (chainage < 12379.9)
        assert held[:, inside].mean() > 0.99
        assert not held[:, (chainage < 12300.03) | (chainage > 12380.07)].any()


def test_larger_pixels_are_means() -> None:
    noise = np.random.default_rng(1).normal(20.0, 4.0, (1, 1000, 1000)).astype(np.float32)
    mapping = AffineMapping(Affine(0.01, 0, 12300.0, 0, -0.01, 5.0))
    ((_, raster),) = resample([Frame(Pixels(noise), mapping)], Grid.covering(12, 0.1, -5.0, 5.0))
    assert raster.values[:, 5:95].std() < 0.6
    assert np.nanmean(raster.values) == pytest.approx(20.0, abs=0.05)


def test_holes_stay_holes() -> None:
    strip = picture(TRUE, 4000, 900)
    strip.values[:, 300:400, 1000:1200] = np.nan
    ((_, raster), _) = resample([Frame(strip, TRUE)], Grid.covering(12, 0.02, -9.0, 9.0))
    assert np.isnan(raster.values[302:398, 1002:1198]).all()
    assert np.isfinite(raster.values[:298, 2:]).all()


def test_of_overlapping_frames_the_nearer_is_used() -> None:
    places = [AffineMapping(Affine(0.02, 0, 12300.0 + start, 0, -0.02, 2.0)) for start in (0.0, 8.0)]
    frames = [
        Frame(Pixels(np.full((1, 200, 500), value, np.float32)), place) for value, place in zip((1, 2), places, strict=True)
    ]
    ((_, raster),) = resample(frames, Grid.covering(12, 0.02, -2.0, 2.0))
    assert (raster.values[100, :449] == 1).all()
    assert (raster.values[100, 451:900] == 2).all()
    assert np.isnan(raster.values[100, 901:]).all()


@pytest.mark.parametrize("wrong", [(0.6, 0.0), (0.0, -0.4), (-0.08, 0.05)])
def test_a_wrong_point_is_named_and_not_used(wrong: tuple[float, float]) -> None:
    places = control_places(LONG)
    places[3] += wrong
    fit = fit_control(CONTROL, places)
    assert np.flatnonzero(fit.outliers).tolist() == [3]
    assert fit.residuals[3] == pytest.approx(wrong, abs=0.03)
    corner = np.column_stack(fit.mapping.forward(np.array([0.0, 4080.0]), np.array([0.0, 900.0])))
    true = np.column_stack(LONG.forward(np.array([0.0, 4080.0]), np.array([0.0, 900.0])))
    assert np.abs(corner - true).max() < 0.02


def test_a_drifting_odometer_is_followed_where_points_are_enough() -> None:
    rng = np.random.default_rng(5)
    pixels = np.column_stack([np.linspace(20, 4060, 60), rng.uniform(20, 880, 60)])

    def drift(column: np.ndarray, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        chainage, arc = LONG.forward(column, row)
        return chainage + 0.2 * np.sin((chainage - 12300) / 12), arc

    places = np.column_stack(drift(*pixels.T)) + rng.normal(0, 0.004, pixels.shape)
    fit = fit_control(pixels, places)
    assert fit.model == "piecewise"
    assert fit.predicted is not None
    assert fit.predicted < 0.02
    test = np.column_stack([rng.uniform(50, 4000, 500), rng.uniform(0, 900, 500)])
    found = np.column_stack(fit.mapping.forward(*test.T))
    assert np.abs(found - np.column_stack(drift(*test.T))).max() < 0.03
    assert np.column_stack(inverse(fit.mapping, *found.T)) == pytest.approx(test, abs=1e-6)


def test_two_points_give_one_scale() -> None:
    fit = fit_control(CONTROL[[0, 5]], control_places(TRUE, CONTROL[[0, 5]], 0.0))
    assert fit.model == "similarity"
    assert fit.predicted is None
    assert fit.mapping.linear == pytest.approx(TRUE.linear, abs=1e-6)
    assert "on one line or only two" in check_fit(fit)[0]


@pytest.mark.parametrize(
    ("pixels", "places", "message"),
    [
        ([[1, 2]], [[12300, 1]], "at least two"),
        ([[1, 2], [1, 2]], [[12300, 1], [12301, 1]], "same pixel"),
        ([[1, 2], [9, 2]], [[12300, 1], [12300, 1]], "same place"),
    ],
)
def test_points_that_determine_nothing_are_refused(pixels: list, places: list, message: str) -> None:
    with pytest.raises(InputError, match=message):
        fit_control(np.array(pixels, float), np.array(places, float))


def test_contradicting_points_are_refused() -> None:
    places = control_places(LONG)[::-1].copy()
    with pytest.raises(InputError, match=r"contradict|shear"):
        check_fit(fit_control(CONTROL, places))


@pytest.mark.parametrize(
    ("place", "message"),
    [
        (Affine(0.02, 0, 12300.0, 0, 0.02, -9.0), "mirrored"),
        (Affine(-0.02, 0, 12380.0, 0, -0.02, 9.0), "mirrored"),
        (Affine(0.02, 0, 0.0, 0, -0.02, 9.0), "outside the survey"),
        (Affine(0.02, 0, 12300.0, 0, -0.02, 18.0), "seam of the image"),
        (Affine(0.02, 0, 12300.0, 0, -0.02, 0.0), "seam of the image"),
        (Affine(0.02, 0, 12300.0, 0, -0.002, -20.0), "beside the lining"),
    ],
)
def test_an_image_that_cannot_fit_is_refused(place: Affine, message: str) -> None:
    with pytest.raises(InputError, match=message):
        check_placement(AffineMapping(place), 4000, 900, LINING)


@pytest.mark.parametrize(
    ("place", "warning"),
    [
        (Affine(0.0204, 0, 12300.0, 0, -0.02, 9.0), "exceeds the survey by 1.60 m after its end"),
        (Affine(0.02, 0, 12298.0, 0, -0.02, 9.0), "exceeds the survey by 2.00 m before its start"),
        (Affine(0.02, 0, 12300.0, 0, -0.02, 10.0), "exceeds the lining by 1.00 m"),
        (Affine(-0.02, 0, 12380.0, 0, 0.02, -9.0), "turned by 180°"),
    ],
)
def test_an_image_that_fits_badly_is_warned_of(place: Affine, warning: str) -> None:
    (found,) = check_placement(AffineMapping(place), 4000, 900, LINING).warnings
    assert warning in found


def test_an_image_that_fits_is_not_warned_of() -> None:
    assert check_placement(TRUE, 4000, 900, LINING).warnings == []
    assert check_fit(fit_control(CONTROL, control_places(LONG))) == []


def test_a_turned_image_has_its_place() -> None:
    turned = Affine(0.0, 0.02, 12300.0, 0.02, 0.0, -9.0)  # columns run up the arc, rows with the chainage
    assert turned.determinant < 0
    image = picture(AffineMapping(turned), 900, 4000)
    assert check_placement(AffineMapping(turned), 900, 4000, LINING).warnings == []
    blocks = list(resample([Frame(image, AffineMapping(turned))], Grid.covering(12, 0.02, -9.0, 9.0)))
    assert np.abs(found_spots(blocks) - SPOTS).max() < 0.005


def test_piecewise_mappings_are_inverted_exactly() -> None:
    mapping = PiecewiseMapping(
        LONG.linear, np.array([12310.0, 12330, 12370]), np.array([0.3, -0.2, 0.1]), np.array([0.1, 0, -0.1])
    )
    column, row = np.array([-50.0, 700, 2000, 3900]), np.array([0.0, 100, 400, 899])
    assert np.column_stack(inverse(mapping, *mapping.forward(column, row))) == pytest.approx(
        np.column_stack([column, row]), abs=1e-6
    )


@pytest.mark.parametrize(
    ("side", "pixel"), [(0.0105, 0.01), (0.00987, 0.01), (0.0196, 0.02), (0.03, 0.025), (0.001, 0.002), (3, 1)]
)
def test_pixels_divide_a_block(side: float, pixel: float) -> None:
    assert usual_pixel(AffineMapping(Affine(side, 0, 0, 0, -2 * side, 0))) == pixel
