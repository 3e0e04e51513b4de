"""Guess of the kind of an intensity from its values (dB of two kinds, counts, or nothing), with reasons.

The values alone decide, so a result is only a guess; knowledge of the scanner takes precedence. Limits follow from the kinds
themselves, and from the part of their range that a tunnel can show:

- dB are logarithms. Over a tunnel's ranges (1 to 50 m) the inverse square is 34 dB, reflectance of 2 to 90 % is 17 dB,
  incidence up to 80° is 8 dB: about 60 dB from the faintest lining to the brightest, without retroreflecting targets.
  Values with a larger spread are not dB.
- Values all in 0 … 1 are fractions of full scale: as dB they would be a lining uniform to 1 dB and, as an amplitude,
  all within 1 dB of the detection limit.
- *Amplitude* is dB above the weakest detectable echo (RIEGL), so it is rarely negative. *Reflectance* is dB of a
  white diffuse target at the same range, so lining (2 to 90 %) is at −17 to −0.5 dB, and only retroreflectors above 0.
- Counts are whole numbers, mostly of 8, 11, 12 or 16 bits, or scaled to 0 … 1; as powers they are never negative. Leica's
  exchange formats may shift 12 bits to −2048 … 2047.

Source: RIEGL, *LAS extrabytes implementation*, 2017 (amplitude, reflectance); Höfle & Pfeifer, *ISPRS J. Photogramm.
Remote Sens.* 62, 2007 (range, incidence and reflectance in the radar equation).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_SPREAD_DB = 60.0
"""Maximum spread of lining in a tunnel, dB, between the 1st and 99th percentile."""

MAX_LEVEL_DB = 150.0
"""Absolute level in dB that no scanner reports: 10¹⁵ times the reference."""

MIN_SATURATED_SHARE = 0.01
"""Share of values equal to the maximum from which a scan is reported as saturated …"""

SATURATION_RATIO = 3.0
"""… if they are also so many times as frequent as the next lower value: coarse steps have many values each."""

MIN_VALUES = 30
"""Minimum number of values for a remark."""

_BITS = (8, 11, 12, 16)
_SHIFTED = (-2048.0, 2047.0)  # 12 bits, as Leica's PTS has them


@dataclass(frozen=True)
class ValueRange:
    """Spread of the values of a dimension.

    Attributes
    ----------
    count, missing : int
        Number of values, and of these the number of NaN or infinite ones.
    least, low, median, high, most : float
        Minimum, 1st percentile, median, 99th percentile, maximum of the finite values; NaN if there are none.
    whole : bool
        True if all finite values are whole numbers.
    """

    count: int
    missing: int
    least: float
    low: float
    median: float
    high: float
    most: float
    whole: bool

    @property
    def spread(self) -> float:
        """Difference between the 99th and the 1st percentile."""
        return self.high - self.low


@dataclass(frozen=True)
class KindGuess:
    """Possible kind of an intensity.

    Attributes
    ----------
    kind : {'amplitude', 'reflectance', 'linear', 'none'}
        Value for `tunneldb survey add --intensity-kind`.
    what : str
        Description: ``16-bit counts: linear``.
    reason : str
        Reason.
    """

    kind: str
    what: str
    reason: str


def value_range(values: NDArray[Any]) -> ValueRange:
    """Return the spread of values, in the file's own unit."""
    numbers = np.asarray(values, np.float64).ravel()
    finite = numbers[np.isfinite(numbers)]
    missing = len(numbers) - len(finite)
    if not len(finite):
        return ValueRange(len(numbers), missing, np.nan, np.nan, np.nan, np.nan, np.nan, whole=False)
    least, low, median, high, most = (float(value) for value in np.percentile(finite, [0.0, 1.0, 50.0, 99.0, 100.0]))
    return ValueRange(len(numbers), missing, least, low, median, high, most, bool(np.all(finite == np.rint(finite))))


def guess_kind(values: NDArray[Any] | ValueRange, name: str = "") -> list[KindGuess]:
    """Guess the kind of an intensity.

    Parameters
    ----------
    values : (n,) array of any number type, or ValueRange
        Sample of the dimension, in the file's own unit, with the scale and offset of the file.
    name : str
        Name of the dimension; if the values allow both kinds of dB, a name with one of them puts that first.

    Returns
    -------
    list of KindGuess
        Possible kinds, the likeliest first; empty if there is none (negative and far from any dB).
    """
    found = values if isinstance(values, ValueRange) else value_range(values)
    if not np.isfinite(found.median):
        return [KindGuess("none", "no intensity", "no value is a number")]
    if found.least == found.most:
        return [KindGuess("none", "no intensity", f"all values are {found.least:g}")]
    guesses = [guess for guess in (_linear(found), *_decibels(found)) if guess is not None]
    # dB usually have fractions; powers are usually whole numbers, or all within 0 … 1.
    if not found.whole and found.high > 1.0:
        guesses.sort(key=lambda guess: guess.kind == "linear")
    said = [guess for guess in guesses if guess.kind in name.lower()]
    return [*said, *(guess for guess in guesses if guess not in said)]


def contradiction(kind: str, values: NDArray[Any] | ValueRange) -> str | None:
    """Return the reason why values cannot be an intensity of the declared kind.

    Parameters
    ----------
    kind : {'amplitude', 'reflectance', 'linear', 'none'}
    values : (n,) array of any number type, or ValueRange

    Returns
    -------
    str or None
        Phrase for an error message, without the name of file or dimension; None if they can be.
    """
    found = values if isinstance(values, ValueRange) else value_range(values)
    if kind == "none":
        return None
    if not np.isfinite(found.median):
        return "no value is a number"
    if found.least == found.most:
        return f"all values are {found.least:g}"
    reason = _not_linear(found) if kind == "linear" else _not_decibels(found)
    if reason is None:
        return None
    others = [guess for guess in guess_kind(found) if guess.kind != kind]
    return f"{reason}; it looks like {others[0].what}" if others else reason


def doubt(kind: str, values: NDArray[Any]) -> str | None:
    """Return a remark on unusual values of a kind, which are not an error.

    Parameters
    ----------
    kind : {'amplitude', 'reflectance', 'linear', 'none'}
    values : (n,) array of any number type
        Sample, in the file's own unit.

    Returns
    -------
    str or None
        Phrase for a remark; None if there is nothing to report.
    """
    finite = np.asarray(values, np.float64)
    finite = finite[np.isfinite(finite)]
    if kind == "none" or len(finite) < MIN_VALUES:
        return None
    said = []
    steps, counts = np.unique(finite, return_counts=True)
    if len(steps) > 1 and counts[-1] >= MIN_SATURATED_SHARE * len(finite) and counts[-1] > SATURATION_RATIO * counts[-2]:
        said.append(
            f"{100 * counts[-1] / len(finite):.2g} % of the intensities are the greatest value, {steps[-1]:g}: the scan is"
            " saturated, so that darker areas may not show"
        )
    found = value_range(finite)
    likeliest = guess_kind(found)[0]
    if kind == "linear" and likeliest.kind != "linear":
        said.append(
            f"the intensities, declared linear, look like {likeliest.what} ({likeliest.reason}); if so, use"
            f" --intensity-kind {likeliest.kind}"
        )
    if kind == "reflectance" and found.low > 0.0:
        said.append(
            f"the intensities, declared reflectance, range from {found.low:.4g} to {found.high:.4g} dB (1 to 99 %), but"
            " lining is below 0 dB, the level of a white target; check whether --intensity-kind amplitude is right"
        )
    if kind == "amplitude" and found.high < 0.0:
        said.append(
            f"the intensities, declared amplitude, range from {found.low:.4g} to {found.high:.4g} dB (1 to 99 %), but an"
            " amplitude is above 0 dB, the detection limit; check whether --intensity-kind reflectance is right"
        )
    return "; ".join(said) or None


def _not_linear(found: ValueRange) -> str | None:
    if found.low < 0.0:
        return f"values go below zero ({found.least:g}), but linear intensity is never negative"
    return None


def _not_decibels(found: ValueRange) -> str | None:
    if max(abs(found.low), abs(found.high)) > MAX_LEVEL_DB:
        return f"values from {found.low:g} to {found.high:g} (1 to 99 %) are too far from zero to be dB"
    if found.spread > MAX_SPREAD_DB:
        return (
            f"values spread over {found.spread:g} (1 to 99 %); dB of lining in a tunnel spread over at most {MAX_SPREAD_DB:g}"
        )
    if found.low >= 0.0 and found.high <= 1.0:
        return f"values from {found.low:.3g} to {found.high:.3g} (1 to 99 %) are fractions of 1, not dB of a lining"
    return None


def _linear(found: ValueRange) -> KindGuess | None:
    limits = f"from {found.least:g} to {found.most:g}"
    if _not_linear(found) is None:
        if not found.whole:
            what = "0–1 float: linear" if found.high <= 1.0 else "linear"
            return KindGuess("linear", what, f"fractions {limits}")
        bits = next((bits for bits in _BITS if found.most < 2**bits), None)
        what = "counts: linear" if bits is None else f"{bits}-bit counts: linear"
        return KindGuess("linear", what, f"whole numbers {limits}")
    if found.whole and found.spread > MAX_SPREAD_DB and _SHIFTED[0] <= found.least and found.most <= _SHIFTED[1]:
        what = "12-bit counts, shifted below zero: linear after adding 2048 to each"
        return KindGuess("linear", what, f"whole numbers {limits}")
    return None


def _decibels(found: ValueRange) -> list[KindGuess]:
    if _not_decibels(found) is not None:
        return []
    spread = f"{found.low:.4g} to {found.high:.4g} (1 to 99 %)"
    guesses = []
    if found.median >= 0.0:
        guesses.append(KindGuess("amplitude", "dB amplitude", f"{spread}, mostly above zero, as above a detection limit"))
    if found.low < 0.0:
        guesses.append(KindGuess("reflectance", "dB reflectance", f"{spread}, below zero, as for targets darker than white"))
    return guesses if found.median >= 0.0 else guesses[::-1]
