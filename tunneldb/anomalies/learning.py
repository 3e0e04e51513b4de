"""What the reviews of an owner's tunnels teach the model of evidence: how sure it may be, and how much each reason counts.

Ways to adjust the model are held against the model as it is, on reviews of other places than those that they were fitted to:
to *recalibrate* it, a slope and an offset of the logarithm of the odds (Platt, 1999); to *refit* the weights of its reasons, a
factor for each and an offset; and to *extend* it, by terms that are linear in its features, beside these. All have Gaussian
priors about no change (ridge), so that few reviews change little.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from scipy.optimize import minimize

from tunneldb.anomalies.evidence import EvidenceModel, deviations
from tunneldb.anomalies.features import FEATURES, NAMES
from tunneldb.anomalies.verdict import weigh, weigh_built
from tunneldb.arrays import Bool, Float, Int64

Way = Literal["base", "recalibrated", "refit", "extended"]

SLOPE, OFFSET = 0.25, 1.0
"""Standard deviations of slope and offset before any review: an owner's leaks are more or less frequent by a factor of 2.7."""

FACTORS = (0.125, 0.25, 0.5)
"""Standard deviations of the reasons' factors that are tried."""

TERMS = (0.125, 0.25, 0.5)
"""Of the terms of features, beside factors of the greatest of FACTORS."""

FEWEST, FEWEST_REFIT = 10, 25
"""With fewer reviews nothing is learned; with fewer than the second the reasons' weights stay."""

CHANCE = 1.5
"""Something is learned if it is better by more than so many standard errors of the gain on reviews held out. With less, more is
learned that is none; with 2, of 50 reviews next to nothing (both on synthetic reviews)."""

FOLDS = 5
"""Parts of the reviews, each judged by what was fitted to the others."""

APART = 10.0
"""Reviews of one stretch of so many metres are in one part: neighbours are often of one kind, and would tell of each other."""

REASONS = tuple(dict.fromkeys(feature.reason for feature in FEATURES))
"""Reasons of the features, each once."""

_REASON = np.array([REASONS.index(feature.reason) for feature in FEATURES])


@dataclass(frozen=True)
class Adjustment:
    """How the model of evidence is adjusted to an owner.

    Attributes
    ----------
    way : {'base', 'recalibrated', 'refit', 'extended'}
        Not at all; slope and offset alone; factors and offset; or terms of features, too.
    slope, offset : float
        What the logarithm of the odds is multiplied by, and what is added then.
    factors : mapping
        Of reasons: by how much more or less they count; 1 for those without.
    terms : mapping
        Of features: centre, scale, and the logarithm of the odds by scale; none for those without.
    """

    way: Way = "base"
    slope: float = 1.0
    offset: float = 0.0
    factors: Mapping[str, float] = field(default_factory=dict)
    terms: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def apply(self, model: EvidenceModel, name: str) -> EvidenceModel:
        """Adjust a model; its version is that of the model, ``+``, and a name."""
        each = np.array([self.factors.get(feature.reason, 1.0) for feature in FEATURES])
        own = np.array([self.terms.get(feature.name, (0.0, 1.0, 0.0)) for feature in FEATURES]).T
        return replace(
            model,
            version=f"{model.version}+{name}",
            constant=self.slope * model.constant + self.offset,
            factors=self.slope * each * model.factors,
            own=own,
        )

    def to_json(self) -> dict[str, Any]:
        """Parameters as they are stored."""
        return {"slope": self.slope, "offset": self.offset, "factors": dict(self.factors), "terms": dict(self.terms)}

    @classmethod
    def from_json(cls, way: Way, values: Mapping[str, Any]) -> Adjustment:
        """Read stored parameters."""
        return cls(way, values["slope"], values["offset"], values["factors"], values["terms"])


@dataclass(frozen=True)
class Reviewed:
    """Anomalies that inspectors have reviewed.

    Attributes
    ----------
    features : (n, len(FEATURES)) float array
        What was measured of each.
    outline : (n,) float array
        How much its outline tells, 0 to 1 (:class:`tunneldb.anomalies.verdict.Verdict`).
    leak : (n,) bool array
        Whether it was said to be a leak.
    tunnel : (n,) int array
        Which tunnel it is in.
    chainage : (n,) float array
        Where its middle is, m.
    """

    features: Float
    outline: Float
    leak: Bool
    tunnel: Int64
    chainage: Float


@dataclass(frozen=True)
class HeldOut:
    """How a way fares on reviews that it was not fitted to.

    Attributes
    ----------
    way : {'base', 'recalibrated', 'refit', 'extended'}
    loss : float
        Mean negative logarithm of the probability of what was said.
    false_leaks : int
        What it takes for leaks and was said to be none.
    missed : int
        Leaks that it takes for none.
    """

    way: Way
    loss: float
    false_leaks: int
    missed: int

    @classmethod
    def of(cls, way: Way, odds: Float, leak: Bool) -> HeldOut:
        """Hold logarithms of the odds (n,) of leaks against what was said."""
        called = odds >= 0.0
        return cls(way, float(losses(odds, leak).mean()), int((called & ~leak).sum()), int((leak & ~called).sum()))


@dataclass(frozen=True)
class Lesson:
    """What reviews teach.

    Attributes
    ----------
    adjustment : Adjustment
        The way that is best on reviews held out, fitted to all of them; no change where none is better than that.
    held_out : list of HeldOut
        The ways that were tried, the model as it is first.
    reviews : int
        How many there were.
    """

    adjustment: Adjustment
    held_out: Sequence[HeldOut]
    reviews: int


def learn(model: EvidenceModel, reviewed: Reviewed) -> Lesson:
    """Learn from reviews: choose whether to recalibrate or refit a model, or leave it, by what was not seen in fitting.

    Another way than to leave it is taken if on reviews held out it is better by more than chance (CHANCE), stretches of APART
    metres being what chance draws.

    Parameters
    ----------
    model : EvidenceModel
        As it comes with the program.
    reviewed : Reviewed
        At least one.
    """
    leak, count = reviewed.leak, len(reviewed.leak)
    parts = by_reason(weigh(model, reviewed.features, reviewed.outline))
    stretch = stretches(reviewed.tunnel, reviewed.chainage)
    fold = folds(stretch)
    ways: list[tuple[Way, _Problem]] = []
    if count >= FEWEST and len(np.unique(fold)) > 1:
        ways.append(("recalibrated", _recalibration(model.constant, parts)))
    if ways and count >= FEWEST_REFIT:
        ways += [("refit", _refit(model.constant, parts, width)) for width in FACTORS]
        centre, scale = spread_of(reviewed.features)
        told = weigh_built(deviations(reviewed.features, centre, scale), reviewed.outline)
        ways += [("extended", _refit(model.constant, parts, FACTORS[-1], told, width)) for width in TERMS]
    plain = model.constant + parts.sum(axis=1)
    base = losses(plain, leak)
    tried: dict[Way, tuple[Float, Float, _Problem]] = {}
    for way, problem in ways:
        odds = problem.held_out(leak, fold)
        loss = losses(odds, leak)
        if way not in tried or loss.sum() < tried[way][1].sum():
            tried[way] = odds, loss, problem
    held_out = [HeldOut.of("base", plain, leak), *(HeldOut.of(way, odds, leak) for way, (odds, _, _) in tried.items())]
    better = {way: loss.sum() for way, (_, loss, _) in tried.items() if _beyond_chance(base - loss, stretch)}
    adjustment = Adjustment()
    if better:
        way = min(better, key=lambda one: better[one])
        adjustment = _adjustment(way, tried[way][2].fit(leak), reviewed.features)
    return Lesson(adjustment, held_out, count)


def spread_of(features: Float) -> tuple[Float, Float]:
    """Mean and standard deviation (len(FEATURES),) of features (n, len(FEATURES)); 0 and 1 where nothing differs."""
    known = np.isfinite(features)
    count = np.maximum(known.sum(axis=0), 1)
    centre = np.where(known, features, 0.0).sum(axis=0) / count
    variance = np.where(known, features - centre, 0.0) ** 2
    scale = np.sqrt(variance.sum(axis=0) / count)
    return centre, np.where(scale > 1e-9, scale, 1.0)


def by_reason(contributions: Float) -> Float:
    """Sum what features (n, len(FEATURES)) add by their reasons: (n, len(REASONS))."""
    return np.asarray(contributions @ (_REASON[:, None] == np.arange(len(REASONS))))


def stretches(tunnel: Int64, chainage: Float) -> Int64:
    """Number the stretches of APART metres that hold something, in order of tunnel and chainage: (n,)."""
    places = np.column_stack([tunnel, np.floor(chainage / APART)])
    return np.asarray(np.unique(places, axis=0, return_inverse=True)[1]).reshape(-1)


def folds(stretch: Int64) -> Int64:
    """Part (n,) of FOLDS that each review belongs to: parts follow each other along the tunnels, and hold about as many."""
    counts = np.bincount(stretch)
    middle = np.cumsum(counts) - 0.5 * counts
    return np.asarray((middle * FOLDS / max(len(stretch), 1)).astype(np.int64)[stretch])


def losses(odds: Float, leak: Bool) -> Float:
    """Negative logarithms (n,) of the probabilities of what was said, by the logarithms of the odds of a leak."""
    return np.logaddexp(0.0, np.where(leak, -odds, odds))


@dataclass(frozen=True)
class _Problem:
    """Logistic regression with a Gaussian prior.

    The logarithm of the odds is ``constant + design @ weights``; weights that multiply evidence, whose prior is 1, are not
    negative, as what counted the other way round would be none.
    """

    constant: float
    design: Float
    prior: Float
    width: Float

    def fit(self, leak: Bool, rows: Bool | slice = slice(None)) -> Float:
        """Most probable weights, given some rows."""
        design, said = self.design[rows], leak[rows].astype(np.float64)

        def cost(weights: Float) -> tuple[float, Float]:
            odds = self.constant + design @ weights
            off = (weights - self.prior) / self.width
            wrong = 1.0 / (1.0 + np.exp(-odds)) - said
            return float(losses(odds, leak[rows]).sum() + 0.5 * off @ off), design.T @ wrong + off / self.width

        bounds = [(0.0 if prior else None, None) for prior in self.prior.tolist()]
        return np.asarray(minimize(cost, self.prior, jac=True, method="L-BFGS-B", bounds=bounds).x)

    def held_out(self, leak: Bool, fold: Int64) -> Float:
        """Logarithms of the odds (n,) in each part by weights fitted to the others."""
        odds = np.zeros(len(leak))
        for number in np.unique(fold):
            here = fold == number
            odds[here] = self.constant + self.design[here] @ self.fit(leak, ~here)
        return odds


def _recalibration(constant: float, parts: Float) -> _Problem:
    odds = constant + parts.sum(axis=1)
    return _Problem(0.0, np.column_stack([odds, np.ones(len(odds))]), np.array([1.0, 0.0]), np.array([SLOPE, OFFSET]))


def _refit(constant: float, parts: Float, width: float, told: Float | None = None, term: float = 0.0) -> _Problem:
    """Factors of parts (n, reasons), terms of what features tell (n, features), and an offset, and how wide they spread."""
    told = np.empty((len(parts), 0)) if told is None else told
    counts = parts.shape[1], told.shape[1], 1
    prior, widths = np.repeat([1.0, 0.0, 0.0], counts), np.repeat([width, term, OFFSET], counts)
    return _Problem(constant, np.column_stack([parts, told, np.ones(len(parts))]), prior, widths)


def _adjustment(way: Way, weights: Float, features: Float) -> Adjustment:
    *scales, offset = weights.tolist()
    if way == "recalibrated":
        return Adjustment(way, scales[0], offset)
    factors = dict(zip(REASONS, scales[: len(REASONS)], strict=True))
    if way == "refit":
        return Adjustment(way, 1.0, offset, factors)
    centre, scale = spread_of(features)
    terms = np.column_stack([centre, scale, scales[len(REASONS) :]]).tolist()
    return Adjustment(way, 1.0, offset, factors, dict(zip(NAMES, terms, strict=True)))


def _beyond_chance(gain: Float, stretch: Int64) -> bool:
    """Whether the sum of gains (n,) is more than CHANCE standard errors, where those of a stretch come and go together."""
    sums = np.bincount(stretch, gain)
    return bool(gain.sum() > CHANCE * np.sqrt((sums**2).sum()))
