"""What a dark region is: a leak, a joint, or something else that is dark but dry; how probable, and what speaks for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tunneldb.anomalies.degrees import FEW_PROFILES, told
from tunneldb.anomalies.evidence import EvidenceModel, reasons_of, standard_model
from tunneldb.anomalies.features import DEGREES, FEATURES, NAMES, measure_features
from tunneldb.anomalies.regions import Region
from tunneldb.arrays import Float

Kind = Literal["leak", "joint", "dark"]

NAMED = 0.5
"""What changes the odds by less than a factor of 1.6 is not named as a reason."""

BUILT = ("thin", "rectangular", "stripe", "shape")
"""Reasons that go by the outline, of which few profiles tell nothing."""

LINE = NAMES.index("line")
"""Number of the feature that tells joints from other things that are dark but dry."""


@dataclass(frozen=True)
class Verdict:
    """What a region is taken for.

    Attributes
    ----------
    kind : {'leak', 'joint', 'dark'}
        A leak; a joint; or dark but dry.
    reasons : tuple of str
        Of what is no leak: what it looks like, then what else the model goes by, the strongest first. Of a leak what makes it
        doubtful, at last that it is ``sparse``: on fewer than FEW_PROFILES profiles that lie apart, so that its length and
        area may be wrong by as much as themselves.
    confidence : float
        Probability that it is of its kind, 0 to 1; of joints and what is dark that it is no leak.
    evidence : mapping
        By how much each reason changes the odds of a leak, as logarithms; positive: for it.
    features : (len(FEATURES),) float array
        What was measured of it.
    outline : float
        How much its outline tells, 0 to 1: by so much the reasons of BUILT count.
    model : str
        Version of the model that judged.
    """

    kind: Kind
    reasons: tuple[str, ...]
    confidence: float
    evidence: Mapping[str, float]
    features: Float
    outline: float
    model: str


def classify(region: Region, features: Float | None = None, model: EvidenceModel | None = None) -> Verdict:
    """Tell what a region is, by its features: a leak if that is more probable than not.

    Parameters
    ----------
    region : Region
    features : (len(FEATURES),) float array, optional
        What was measured of it; by default what can be of a region by itself.
    model : EvidenceModel, optional
        What judges it; by default the model that comes with the program.
    """
    model = model or standard_model()
    features = measure_features(region) if features is None else features
    outline = told(region)
    contributions = weigh(model, features[None], np.array([outline]))[0]
    p = float(1.0 / (1.0 + np.exp(-model.constant - contributions.sum())))
    kind: Kind = "leak" if p >= 0.5 else "joint" if features[LINE] >= 0.5 else "dark"
    evidence = reasons_of(contributions)
    against = [name for name, weight in sorted(evidence.items(), key=lambda item: item[1]) if weight <= -NAMED]
    if kind != "leak":
        looks = sorted((name for name in DEGREES if _degree(features, name) > 0.5), key=lambda name: -_degree(features, name))
        against = [*looks, *(name for name in against if name not in looks)]
    if kind == "leak" and region.spacing and region.mask.shape[1] * region.pixel < FEW_PROFILES * region.spacing:
        against.append("sparse")
    return Verdict(kind, tuple(against), p if kind == "leak" else 1.0 - p, evidence, features, outline, model.version)


def weigh(model: EvidenceModel, features: Float, outline: Float) -> Float:
    """What features (n, len(FEATURES)) add to the odds, as logarithms, where outlines (n,) tell more or less."""
    return weigh_built(model.contributions(features), outline)


def weigh_built(contributions: Float, outline: Float) -> Float:
    """What features (n, len(FEATURES)) say, less where they go by outlines (n,) that tell less."""
    built = np.array([feature.reason in BUILT for feature in FEATURES])
    return contributions * np.where(built, outline[:, None], 1.0)


def _degree(features: Float, name: str) -> float:
    return float(features[NAMES.index(f"{name}_degree")])
