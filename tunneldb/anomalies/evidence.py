"""How probable it is that a dark region is a leak: trees of its features, boosted, and what each feature says in them.

The logarithm of the odds is the sum of what the trees add (gradient boosting: Friedman, 2001). On its way through a tree a
region passes nodes; by how much the mean of a node differs from that of the one before is due to the feature that was asked
there (Saabas, 2014). So what each feature says can be told, and adds up.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from tunneldb.anomalies.features import FEATURES
from tunneldb.arrays import Bool, Float, Intp

FORMAT = 2
"""Of the trees' file."""

FAR = 3.0
"""What lies farther out than so many scales counts as that."""


@dataclass(frozen=True)
class EvidenceModel:
    """Boosted trees, their nodes one behind the other.

    Attributes
    ----------
    version : str
        Names the model.
    constant : float
        Logarithm of the odds before anything is known of a region.
    roots : (trees,) int array
        First node of each tree.
    feature : (nodes,) int array
        Number of the feature that is asked.
    threshold : (nodes,) float array
        Up to this value a region goes left.
    missing_left : (nodes,) bool array
        Whether one of which the feature can't be measured goes left.
    left, right : (nodes,) int array
        Next nodes; the node itself at the end of a tree.
    value : (nodes,) float array
        Mean of what a tree adds to the logarithm of the odds, from this node on.
    trained_on : mapping
        What it was fitted to.
    factors : (len(FEATURES),) float array
        By how much more or less each feature counts than in the trees: 1, but for what was learned from an owner's reviews
        (:mod:`tunneldb.anomalies.learning`). Not stored with the trees.
    own : (3, len(FEATURES)) float array
        What was learned of each feature beside the trees: the value from which it counts, a scale, and the logarithm of the
        odds by scale (:func:`deviations`); 0 for what was not. Not stored with the trees.
    """

    version: str
    constant: float
    roots: Intp
    feature: Intp
    threshold: Float
    missing_left: Bool
    left: Intp
    right: Intp
    value: Float
    trained_on: Mapping[str, Any]
    factors: Float = field(default_factory=lambda: np.ones(len(FEATURES)))
    own: Float = field(default_factory=lambda: np.repeat([[0.0], [1.0], [0.0]], len(FEATURES), axis=1))

    def contributions(self, features: Float) -> Float:
        """What each feature adds to the logarithm of the odds.

        Parameters
        ----------
        features : (n, len(FEATURES)) float array
            See :func:`tunneldb.anomalies.features.measure_features`.

        Returns
        -------
        (n, len(FEATURES)) float array
        """
        out = np.zeros(features.shape)
        row = np.arange(len(features))[:, None]
        at = np.broadcast_to(self.roots, (len(features), len(self.roots)))
        while (self.left[at] != at).any():
            asked = self.feature[at]
            measured = features[row, asked]
            goes_left = np.where(np.isnan(measured), self.missing_left[at], measured <= self.threshold[at])
            after = np.where(goes_left, self.left[at], self.right[at])
            np.add.at(out, (np.broadcast_to(row, at.shape), asked), self.value[after] - self.value[at])
            at = after
        centre, scale, weight = self.own
        return out * self.factors + deviations(features, centre, scale) * weight

    def probabilities(self, features: Float) -> Float:
        """Probability (n,) that each region is a leak."""
        return np.asarray(1.0 / (1.0 + np.exp(-self.constant - self.contributions(features).sum(axis=1))))

    def to_json(self) -> dict[str, Any]:
        """Trees as they are stored."""
        arrays = {name: getattr(self, name).tolist() for name in ARRAYS}
        arrays["missing_left"] = self.missing_left.astype(int).tolist()
        return {
            "format": FORMAT, "version": self.version, "features": [feature.name for feature in FEATURES],
            "constant": self.constant, **arrays, "trained_on": dict(self.trained_on),
        }  # fmt: skip

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> EvidenceModel:
        """Read stored trees."""
        if values["format"] != FORMAT or values["features"] != [feature.name for feature in FEATURES]:
            raise ValueError(f"trees of format {values['format']}, of the features {values['features']}")
        arrays: dict[str, Any] = {name: np.array(values[name], kind) for name, kind in ARRAYS.items()}
        return cls(version=values["version"], constant=values["constant"], trained_on=values["trained_on"], **arrays)


ARRAYS: Mapping[str, type] = {
    "roots": np.intp, "feature": np.intp, "threshold": np.float64, "missing_left": np.bool_, "left": np.intp, "right": np.intp,
    "value": np.float64,
}  # fmt: skip
"""Arrays of a model, and of what kind they are."""


def deviations(features: Float, centre: Float, scale: Float) -> Float:
    """How far features (n, len(FEATURES)) lie from their centres, in scales, FAR at the most; 0 where one can't be measured."""
    return np.asarray(np.clip(np.nan_to_num((features - centre) / scale, nan=0.0), -FAR, FAR))


def reasons_of(contributions: Float) -> dict[str, float]:
    """What features (len(FEATURES),) add, summed up by the reasons that they speak of, the strongest first."""
    sums: dict[str, float] = {}
    for feature, weight in zip(FEATURES, contributions.tolist(), strict=True):
        sums[feature.reason] = sums.get(feature.reason, 0.0) + weight
    return dict(sorted(sums.items(), key=lambda item: -abs(item[1])))


@cache
def standard_model() -> EvidenceModel:
    """Model that comes with the program; ``python -m benchmarks.evidence`` makes it."""
    return EvidenceModel.from_json(json.loads(files("tunneldb.anomalies").joinpath("evidence.json").read_text()))
