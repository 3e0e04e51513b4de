"""Adjust the model of evidence to what inspectors said of the regions of their own tunnels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from tunneldb.anomalies.evidence import KINDS, EvidenceModel, softmax
from tunneldb.anomalies.features import FEATURES
from tunneldb.arrays import Float, Int64, Intp

SHIFT = 1.0
"""Standard deviation, before any review, of how much more or less frequent a kind is at an owner's than in the tunnels that the
model was fitted to, in logarithms: by a factor of 2.7."""

GAIN = 0.5
"""Of how much more or less a reason says there, as a share of what it says."""

FOLDS = 5
"""Parts of the reviews, each of which is judged by a model that was adjusted to the others."""

FEWEST = 10
"""Fewer reviews than this tell nothing that could be held against others of them."""

REASONS = tuple(dict.fromkeys(feature.reason for feature in FEATURES))


@dataclass(frozen=True)
class Adjustment:
    """What reviews teach.

    Attributes
    ----------
    model : EvidenceModel
        The adjusted one.
    shifts : mapping
        Of each kind, by how much its score grew.
    gains : mapping
        Of each reason, the factor by which it counts now.
    reviews : int
        What it was adjusted to.
    wrong_before, wrong_after : int
        Reviews that contradict the model before, and those that contradict a model adjusted to the other reviews.
    loss_before, loss_after : float
        Mean negative logarithm of the probability of what was said, likewise.
    """

    model: EvidenceModel
    shifts: Mapping[str, float]
    gains: Mapping[str, float]
    reviews: int
    wrong_before: int
    wrong_after: int
    loss_before: float
    loss_after: float


def adjust(model: EvidenceModel, features: Float, kinds: Int64, version: str, notes: Mapping[str, Any]) -> Adjustment:
    """Adjust a model to reviewed regions: how frequent the kinds are, and how much each reason counts.

    The most probable values are taken, given the reviews and that without them nothing would change (normal distributions about
    no change, SHIFT and GAIN wide). So few reviews change little, and what they say nothing of stays.

    Parameters
    ----------
    model : EvidenceModel
    features : (n, len(FEATURES)) float array
    kinds : (n,) int array
        What each region was said to be, as a number of KINDS.
    version : str
        Name of the adjusted model.
    notes : mapping
        What it was adjusted to, to be stored with it.
    """
    parts = _by_reason(model.contributions(features))
    order = np.random.default_rng(len(kinds)).permutation(len(kinds))
    before = softmax(model.constant + parts.sum(axis=1))
    after = before.copy()
    if len(kinds) >= FEWEST:
        for fold in range(FOLDS):
            out, others = order[fold::FOLDS], np.concatenate([order[k::FOLDS] for k in range(FOLDS) if k != fold])
            after[out] = _probabilities(model, parts[out], _fit(model, parts[others], kinds[others]))
    shifts, gains = _split(_fit(model, parts, kinds))
    named = dict(zip(REASONS, gains.tolist(), strict=True))
    tables = tuple(scores * named[feature.reason] for feature, scores in zip(FEATURES, model.scores, strict=True))
    adjusted = replace(
        model, version=version, constant=model.constant + shifts, scores=tables,
        trained_on={**model.trained_on, "adjusted_to": dict(notes), "adjusted_from": model.version},
    )  # fmt: skip
    return Adjustment(
        adjusted, dict(zip(KINDS, shifts.tolist(), strict=True)), named, len(kinds),
        _wrong(before, kinds), _wrong(after, kinds), _loss(before, kinds), _loss(after, kinds),
    )  # fmt: skip


def _by_reason(contributions: Float) -> Float:
    """Sum what features add (n, features, kinds) by their reasons: (n, reasons, kinds)."""
    number = [REASONS.index(feature.reason) for feature in FEATURES]
    out = np.zeros((len(contributions), len(REASONS), len(KINDS)))
    for k, reason in enumerate(number):
        out[:, reason] += contributions[:, k]
    return out


def _fit(model: EvidenceModel, parts: Float, kinds: Int64) -> Float:
    """Most probable shifts and gains less 1, one behind the other."""
    true = np.eye(len(KINDS))[kinds]

    def cost(values: Float) -> tuple[float, Float]:
        p = _probabilities(model, parts, values)
        wrong = p - true
        slope = np.concatenate([wrong.sum(axis=0), np.einsum("nrk,nk->r", parts, wrong)])
        loss = -np.log(np.maximum((p * true).sum(axis=1), 1e-300)).sum()
        return float(loss + 0.5 * (values**2 / widths**2).sum()), slope + values / widths**2

    widths = np.concatenate([np.full(len(KINDS), SHIFT), np.full(len(REASONS), GAIN)])
    return np.asarray(minimize(cost, np.zeros(len(widths)), jac=True, method="L-BFGS-B").x)


def _split(values: Float) -> tuple[Float, Float]:
    """Shifts of the kinds, and gains of the reasons; what counted the other way round would be no evidence."""
    return values[: len(KINDS)], np.maximum(1.0 + values[len(KINDS) :], 0.0)


def _probabilities(model: EvidenceModel, parts: Float, values: Float) -> Float:
    shifts, gains = values[: len(KINDS)], 1.0 + values[len(KINDS) :]
    return softmax(model.constant + shifts + np.einsum("nrk,r->nk", parts, gains))


def _wrong(probabilities: Float, kinds: Int64 | Intp) -> int:
    """Regions that are taken for leaks and were said not to be, or the other way round."""
    return int(np.count_nonzero((probabilities[:, 0] >= 0.5) != (kinds == 0)))


def _loss(probabilities: Float, kinds: Int64) -> float:
    return float(-np.log(np.maximum(probabilities[np.arange(len(kinds)), kinds], 1e-12)).mean()) if len(kinds) else 0.0
