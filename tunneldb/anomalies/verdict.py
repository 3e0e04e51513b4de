"""Classification of a dark region: a leak, a joint, or a dry dark area, with probability and evidence.

The model of :mod:`tunneldb.anomalies.evidence` gives the probability from the features of
:mod:`tunneldb.anomalies.features`; :func:`kind_of` decides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tunneldb.anomalies.degrees import FEW_PROFILES, straightness_weight
from tunneldb.anomalies.evidence import EvidenceModel, reasons_of, standard_model
from tunneldb.anomalies.features import DEGREES, FEATURES, NAMES, measure_features
from tunneldb.anomalies.regions import Region
from tunneldb.arrays import Float
from tunneldb.finding_kind import FindingKind

MIN_NAMED_CHANGE = 0.5
"""Minimum factor on the odds, 1.6 as a logarithm, for a reason to be named."""

OUTLINE_REASONS = ("thin", "rectangular", "stripe", "shape")
"""Reasons based on the outline, which few profiles do not show."""

LINE_FEATURE = NAMES.index("line")
"""Number of the feature that separates joints from other dry dark areas."""


@dataclass(frozen=True)
class Verdict:
    """Classification of a region.

    Attributes
    ----------
    kind : FindingKind
        A leak; a joint; or another dry dark area.
    reasons : tuple of str
        If not a leak: what it looks like, then further evidence, the strongest first. If a leak: reasons for doubt, and last
        ``sparse``: on fewer than FEW_PROFILES profiles far apart, so that its length and area may be wrong by as much as
        themselves.
    confidence : float
        Probability of its kind, 0 to 1; for joints and dry dark areas that it is no leak.
    evidence : mapping
        Change of the log odds of a leak by each reason; positive: for a leak.
    features : (len(FEATURES),) float array
        Its features.
    outline : float
        Reliability of its outline, 0 to 1: weight of the reasons of OUTLINE_REASONS.
    model : str
        Version of the model used.
    """

    kind: FindingKind
    reasons: tuple[str, ...]
    confidence: float
    evidence: Mapping[str, float]
    features: Float
    outline: float
    model: str


def classify(region: Region, features: Float | None = None, model: EvidenceModel | None = None) -> Verdict:
    """Classify a region by its features: as a leak if that is more probable than not.

    Parameters
    ----------
    region : Region
    features : (len(FEATURES),) float array, optional
        Its features; by default those of the region by itself.
    model : EvidenceModel, optional
        Model to use; by default the one that comes with the program.
    """
    model = model or standard_model()
    features = measure_features(region) if features is None else features
    outline = straightness_weight(region)
    contributions = weigh(model, features[None], np.array([outline]))[0]
    p = float(1.0 / (1.0 + np.exp(-model.constant - contributions.sum())))
    kind = kind_of(p, line=bool(features[LINE_FEATURE] >= 0.5))
    evidence = reasons_of(contributions)
    against = [name for name, weight in sorted(evidence.items(), key=lambda item: item[1]) if weight <= -MIN_NAMED_CHANGE]
    if kind != FindingKind.LEAK:
        looks = sorted((name for name in DEGREES if _degree(features, name) > 0.5), key=lambda name: -_degree(features, name))
        against = [*looks, *(name for name in against if name not in looks)]
    if kind == FindingKind.LEAK and region.spacing and region.mask.shape[1] * region.pixel < FEW_PROFILES * region.spacing:
        against.append("sparse")
    return Verdict(kind, tuple(against), p if kind == FindingKind.LEAK else 1.0 - p, evidence, features, outline, model.version)


def kind_of(probability: float, *, line: bool) -> FindingKind:
    """Return the kind of a region by its probability of being a leak, and by whether it is a line."""
    if probability >= 0.5:
        return FindingKind.LEAK
    return FindingKind.JOINT if line else FindingKind.DARK


def weigh(model: EvidenceModel, features: Float, outline: Float) -> Float:
    """Return the contributions of features (n, len(FEATURES)) to the log odds, with outlines (n,) of given reliability."""
    return weigh_built(model.contributions(features), outline)


def weigh_built(contributions: Float, outline: Float) -> Float:
    """Reduce the contributions of features (n, len(FEATURES)) based on outlines (n,) by the reliability of these."""
    built = np.array([feature.reason in OUTLINE_REASONS for feature in FEATURES])
    return contributions * np.where(built, outline[:, None], 1.0)


def _degree(features: Float, name: str) -> float:
    return float(features[NAMES.index(f"{name}_degree")])
