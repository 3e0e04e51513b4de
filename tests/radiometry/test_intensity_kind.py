"""What an intensity is guessed to be, on values of the simulator's radiometry and of known encodings."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.radiometry.intensity_kind import contradiction, doubt, guess_kind, value_range
from tunneldb.simulate.radiometry import Radiometry, counts

RNG = np.random.default_rng(5)
RANGE = RNG.uniform(2.5, 20.0, 20_000)
COSINE = np.cos(np.arccos(np.clip(3.0 / RANGE, 0.0, 1.0)))
RADIOMETRY = Radiometry()
REFLECTANCE = RADIOMETRY.reflectance(COSINE, np.zeros(RANGE.size, bool), RNG.exponential(1.0, RANGE.size)) + RNG.normal(
    0, 0.3, RANGE.size
)
AMPLITUDE = RADIOMETRY.amplitude(RANGE, REFLECTANCE)
COUNTS = counts(AMPLITUDE)

KINDS = {
    "dB": ("amplitude", AMPLITUDE),
    "hundredths of dB, scaled": ("amplitude", np.round(AMPLITUDE, 2)),
    "dB without range": ("reflectance", REFLECTANCE),
    "16 bits": ("linear", COUNTS),
    "8 bits": ("linear", COUNTS // 256),
    "0 to 1": ("linear", COUNTS / 65535.0),
    "0 to 1 of 32 bits": ("linear", (COUNTS / 65535.0).astype(np.float32)),
    "nothing": ("none", np.zeros(9, np.uint16)),
}


@pytest.mark.parametrize("name", KINDS)
def test_the_first_guess_is_what_it_is(name: str) -> None:
    kind, values = KINDS[name]
    assert guess_kind(values)[0].kind == kind


@pytest.mark.parametrize("name", KINDS)
def test_what_it_is_contradicts_nothing(name: str) -> None:
    kind, values = KINDS[name]
    assert contradiction(kind, values) is None


@pytest.mark.parametrize("name", KINDS)
def test_nothing_is_doubted_about_what_is_right(name: str) -> None:
    assert doubt(*KINDS[name]) is None


@pytest.mark.parametrize(("share", "said"), [(0.25, "25 %"), (0.02, "2 %")])
def test_a_scan_whose_receiver_is_at_its_stop_is_called_saturated(share: float, said: str) -> None:
    stopped = np.minimum(AMPLITUDE, np.quantile(AMPLITUDE, 1.0 - share))
    assert str(doubt("amplitude", stopped)).startswith(f"{said} of the intensities are the greatest value")
    assert "saturated" in str(doubt("linear", np.minimum(COUNTS, np.quantile(COUNTS, 1.0 - share)).round()))


def test_decibels_that_are_declared_counts_are_doubted() -> None:
    assert "--intensity-kind amplitude" in str(doubt("linear", AMPLITUDE))


def test_lining_brighter_than_white_is_doubted() -> None:
    assert "--intensity-kind amplitude" in str(doubt("reflectance", AMPLITUDE))


@pytest.mark.parametrize("kind", ["amplitude", "reflectance"])
def test_counts_are_no_decibels(kind: str) -> None:
    assert "16-bit counts" in str(contradiction(kind, COUNTS))
    assert "0–1 float" in str(contradiction(kind, COUNTS / 65535.0))
    assert "all values are 0" in str(contradiction(kind, np.zeros(9)))


def test_what_is_negative_is_no_power() -> None:
    assert "reflectance" in str(contradiction("linear", REFLECTANCE))
    shifted = np.rint(COUNTS / 16.0 - 2048.0)
    assert [guess.kind for guess in guess_kind(shifted)] == ["linear"]
    assert "linear after adding 2048" in str(contradiction("amplitude", shifted))
    assert "below zero" in str(contradiction("linear", shifted))


def test_a_name_decides_what_values_leave_open() -> None:
    either = AMPLITUDE - np.median(AMPLITUDE) + 2.0
    assert guess_kind(either, "Reflectance")[0].kind == "reflectance"
    assert guess_kind(either, "Amplitude")[0].kind == "amplitude"
    assert guess_kind(COUNTS, "Reflectance")[0].kind == "linear"


def test_values_that_are_none_are_counted_and_left_out() -> None:
    found = value_range(np.array([1.0, np.nan, 3.0, np.inf, 2.0]))
    assert (found.count, found.missing, found.least, found.median, found.most, found.whole) == (5, 2, 1.0, 2.0, 3.0, True)
    assert guess_kind(np.full(3, np.nan))[0].kind == "none"
    assert contradiction("linear", np.full(3, np.nan)) == "no value is a number"


def test_amplitudes_below_zero_are_doubted() -> None:
    below = np.random.default_rng(1).normal(-8.0, 1.5, 5000)
    assert "--intensity-kind reflectance" in str(doubt("amplitude", below))
    assert doubt("amplitude", below + 50.0) is None
    assert doubt("reflectance", below) is None
