"""Adapt the evidence model to an owner's reviews: its certainty, and the weight of each reason.

Adjustments of the model are compared with the unchanged model, on reviews of other places than those used for fitting:
*recalibrate*, a slope and an offset of the log odds (Platt, 1999); *refit*, a factor for the weight of each reason and an
offset; and *extend*, additional terms that are linear in its features. All have Gaussian priors centred on no change (ridge),
so that few reviews change little.
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

SLOPE_PRIOR, OFFSET_PRIOR = 0.25, 1.0
"""Prior standard deviations of slope and offset: an owner's leaks are more or less frequent by a factor of 2.7."""

FACTOR_PRIORS = (0.125, 0.25, 0.5)
"""Standard deviations of the reasons' factors that are tried."""

TERM_PRIORS = (0.125, 0.25, 0.5)
"""Standard deviations of the terms of features, together with factors of the greatest of FACTOR_PRIORS."""

MIN_REVIEWS, MIN_REVIEWS_REFIT = 10, 25
"""Minimum number of reviews for learning anything, and for changing the reasons' weights."""

MIN_GAIN = 1.5
"""Minimum gain on held-out reviews, in standard errors. With less, random effects are learned more often; with 2, next to
nothing is learned from 50 reviews (both on synthetic reviews)."""

FOLDS = 5
"""Number of parts of the reviews; each is predicted by the model fitted to the others."""

STRETCH_LENGTH = 10.0
"""Length of stretches whose reviews stay in one part, m: neighbours are often of one kind, and would reveal each other."""

REASONS = tuple(dict.fromkeys(feature.reason for feature in FEATURES))
"""Reasons of the features, without duplicates."""

_REASON = np.array([REASONS.index(feature.reason) for feature in FEATURES])


@dataclass(frozen=True)
class Adjustment:
    """Adjustment of the evidence model to an owner.

    Attributes
    ----------
    way : {'base', 'recalibrated', 'refit', 'extended'}
        None; slope and offset alone; factors and offset; or terms of features in addition.
    slope, offset : float
        Factor on the log odds, and the term added then.
    factors : mapping
        Factor on the weight by reason; 1 for those missing.
    terms : mapping
        By feature: centre, scale, and the log odds per scale; none for those missing.
    """

    way: Way = "base"
    slope: float = 1.0
    offset: float = 0.0
    factors: Mapping[str, float] = field(default_factory=dict)
    terms: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def apply(self, model: EvidenceModel, name: str) -> EvidenceModel:
        """Adjust a model; the version is that of the model, ``+``, and a name."""
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
        """Return the parameters in the form in which they are stored."""
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
        Features of each.
    outline : (n,) float array
        Reliability of its outline, 0 to 1 (:class:`tunneldb.anomalies.verdict.Verdict`).
    leak : (n,) bool array
        True if the inspector called it a leak.
    tunnel : (n,) int array
        Number of its tunnel.
    chainage : (n,) float array
        Chainage of its middle, m.
    """

    features: Float
    outline: Float
    leak: Bool
    tunnel: Int64
    chainage: Float


@dataclass(frozen=True)
class HeldOut:
    """Performance of an adjustment on held-out reviews.

    Attributes
    ----------
    way : {'base', 'recalibrated', 'refit', 'extended'}
    loss : float
        Mean negative logarithm of the probability of the review's answer.
    false_leaks : int
        Number of false alarms: predicted as leaks, reviewed as none.
    missed : int
        Number of leaks predicted as none.
    """

    way: Way
    loss: float
    false_leaks: int
    missed: int

    @classmethod
    def of(cls, way: Way, odds: Float, leak: Bool) -> HeldOut:
        """Compare log odds (n,) of leaks with the reviews."""
        called = odds >= 0.0
        return cls(way, float(losses(odds, leak).mean()), int((called & ~leak).sum()), int((leak & ~called).sum()))


@dataclass(frozen=True)
class Lesson:
    """Result of learning from reviews.

    Attributes
    ----------
    adjustment : Adjustment
        Adjustment that is best on held-out reviews, fitted to all of them; no change if none is better.
    held_out : list of HeldOut
        Results of all adjustments, the unchanged model first.
    reviews : int
        Number of reviews.
    """

    adjustment: Adjustment
    held_out: Sequence[HeldOut]
    reviews: int


def learn(model: EvidenceModel, reviewed: Reviewed) -> Lesson:
    """Learn from reviews: recalibrate, refit or extend the model, or leave it, whichever predicts held-out reviews best.

    A change is accepted if it is better on held-out reviews by more than chance (MIN_GAIN), with stretches of STRETCH_LENGTH
    metres as the random units.

    Parameters
    ----------
    model : EvidenceModel
        Model of the program.
    reviewed : Reviewed
        At least one review.
    """
    leak, count = reviewed.leak, len(reviewed.leak)
    parts = by_reason(weigh(model, reviewed.features, reviewed.outline))
    stretch = stretches(reviewed.tunnel, reviewed.chainage)
    fold = folds(stretch)
    ways: list[tuple[Way, _Problem]] = []
    if count >= MIN_REVIEWS and len(np.unique(fold)) > 1:
        ways.append(("recalibrated", _recalibration(model.constant, parts)))
    if ways and count >= MIN_REVIEWS_REFIT:
        ways += [("refit", _refit(model.constant, parts, width)) for width in FACTOR_PRIORS]
        centre, scale = spread_of(reviewed.features)
        terms = weigh_built(deviations(reviewed.features, centre, scale), reviewed.outline)
        ways += [("extended", _refit(model.constant, parts, FACTOR_PRIORS[-1], terms, width)) for width in TERM_PRIORS]
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
    """Return mean and standard deviation (len(FEATURES),) of features (n, len(FEATURES)); 0 and 1 for constant ones."""
    known = np.isfinite(features)
    count = np.maximum(known.sum(axis=0), 1)
    centre = np.where(known, features, 0.0).sum(axis=0) / count
    variance = np.where(known, features - centre, 0.0) ** 2
    scale = np.sqrt(variance.sum(axis=0) / count)
    return centre, np.where(scale > 1e-9, scale, 1.0)


def by_reason(contributions: Float) -> Float:
    """Sum the contributions of features (n, len(FEATURES)) by reason: (n, len(REASONS))."""
    return np.asarray(contributions @ (_REASON[:, None] == np.arange(len(REASONS))))


def stretches(tunnel: Int64, chainage: Float) -> Int64:
    """Assign reviews to stretches of STRETCH_LENGTH metres, numbered in order of tunnel and chainage: (n,)."""
    places = np.column_stack([tunnel, np.floor(chainage / STRETCH_LENGTH)])
    return np.asarray(np.unique(places, axis=0, return_inverse=True)[1]).reshape(-1)


def folds(stretch: Int64) -> Int64:
    """Assign each review (n,) to one of FOLDS parts, consecutive along the tunnels and of about equal size."""
    counts = np.bincount(stretch)
    middle = np.cumsum(counts) - 0.5 * counts
    return np.asarray((middle * FOLDS / max(len(stretch), 1)).astype(np.int64)[stretch])


def losses(odds: Float, leak: Bool) -> Float:
    """Return the negative logarithms (n,) of the probabilities of the reviews, from the log odds of a leak."""
    return np.logaddexp(0.0, np.where(leak, -odds, odds))


@dataclass(frozen=True)
class _Problem:
    """Logistic regression with a Gaussian prior.

    The log odds are ``constant + design @ weights``. Weights that multiply evidence, with prior mean 1, are not negative,
    because evidence must not count in the opposite direction.
    """

    constant: float
    design: Float
    prior: Float
    width: Float

    def fit(self, leak: Bool, rows: Bool | slice = slice(None)) -> Float:
        """Fit the most probable weights to some rows."""
        design, answers = self.design[rows], leak[rows].astype(np.float64)

        def cost(weights: Float) -> tuple[float, Float]:
            odds = self.constant + design @ weights
            off = (weights - self.prior) / self.width
            wrong = 1.0 / (1.0 + np.exp(-odds)) - answers
            return float(losses(odds, leak[rows]).sum() + 0.5 * off @ off), design.T @ wrong + off / self.width

        bounds = [(0.0 if prior else None, None) for prior in self.prior.tolist()]
        return np.asarray(minimize(cost, self.prior, jac=True, method="L-BFGS-B", bounds=bounds).x)

    def held_out(self, leak: Bool, fold: Int64) -> Float:
        """Return the log odds (n,) in each part with weights fitted to the others."""
        odds = np.zeros(len(leak))
        for number in np.unique(fold):
            here = fold == number
            odds[here] = self.constant + self.design[here] @ self.fit(leak, ~here)
        return odds


def _recalibration(constant: float, parts: Float) -> _Problem:
    odds = constant + parts.sum(axis=1)
    return _Problem(
        0.0, np.column_stack([odds, np.ones(len(odds))]), np.array([1.0, 0.0]), np.array([SLOPE_PRIOR, OFFSET_PRIOR])
    )


def _refit(constant: float, parts: Float, width: float, features: Float | None = None, term: float = 0.0) -> _Problem:
    """Set up factors of parts (n, reasons), terms of features (n, features), and an offset, with their prior widths."""
    features = np.empty((len(parts), 0)) if features is None else features
    counts = parts.shape[1], features.shape[1], 1
    prior, widths = np.repeat([1.0, 0.0, 0.0], counts), np.repeat([width, term, OFFSET_PRIOR], counts)
    return _Problem(constant, np.column_stack([parts, features, np.ones(len(parts))]), prior, widths)


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
    """Return True if the sum of gains (n,) exceeds MIN_GAIN standard errors, with each stretch as one unit."""
    sums = np.bincount(stretch, gain)
    return bool(gain.sum() > MIN_GAIN * np.sqrt((sums**2).sum()))
