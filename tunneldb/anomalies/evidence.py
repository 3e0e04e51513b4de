"""Probability that a dark region is a leak, by boosted trees of its features, with the contribution of each feature.

The log odds are the sum of the trees' contributions (gradient boosting: Friedman, 2001). On its path through a tree a region
passes nodes; the difference of a node's mean from that of the previous node is attributed to the feature that was tested there
(Saabas, 2014). These contributions of the features add up to the log odds.
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
"""Format version of the trees' file."""

MAX_DEVIATION = 3.0
"""Maximum deviation of a feature, in scales; larger ones are clipped."""


@dataclass(frozen=True)
class EvidenceModel:
    """Boosted trees, with their nodes in one sequence.

    Attributes
    ----------
    version : str
        Name of the model.
    constant : float
        Log odds before any feature of a region is known.
    roots : (trees,) int array
        First node of each tree.
    feature : (nodes,) int array
        Number of the tested feature.
    threshold : (nodes,) float array
        A region up to this value goes left.
    missing_left : (nodes,) bool array
        True if a region without that feature goes left.
    left, right : (nodes,) int array
        Next nodes; the node itself at the end of a tree.
    value : (nodes,) float array
        Mean contribution of the tree to the log odds, from this node on.
    trained_on : mapping
        Training data.
    factors : (len(FEATURES),) float array
        Factor on the weight of each feature relative to the trees: 1, except for what was learned from an owner's reviews
        (:mod:`tunneldb.anomalies.learning`). Not stored with the trees.
    own : (3, len(FEATURES)) float array
        Learned terms of each feature in addition to the trees: the value from which it counts, a scale, and the log odds per
        scale (:func:`deviations`); 0 if none. Not stored with the trees.
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
        """Return the contribution of each feature to the log odds.

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
        """Return the probability (n,) that each region is a leak."""
        return np.asarray(1.0 / (1.0 + np.exp(-self.constant - self.contributions(features).sum(axis=1))))

    def to_json(self) -> dict[str, Any]:
        """Return the trees in the form in which they are stored."""
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
            raise ValueError(f"unsupported trees: format {values['format']}, features {values['features']}")
        arrays: dict[str, Any] = {name: np.array(values[name], kind) for name, kind in ARRAYS.items()}
        return cls(version=values["version"], constant=values["constant"], trained_on=values["trained_on"], **arrays)


ARRAYS: Mapping[str, type] = {
    "roots": np.intp, "feature": np.intp, "threshold": np.float64, "missing_left": np.bool_, "left": np.intp, "right": np.intp,
    "value": np.float64,
}  # fmt: skip
"""Arrays of a model, and their types."""


def deviations(features: Float, centre: Float, scale: Float) -> Float:
    """Return the deviation of features (n, len(FEATURES)) from centres, in scales, at most MAX_DEVIATION; 0 if unknown."""
    return np.asarray(np.clip(np.nan_to_num((features - centre) / scale, nan=0.0), -MAX_DEVIATION, MAX_DEVIATION))


def reasons_of(contributions: Float) -> dict[str, float]:
    """Sum the contributions of features (len(FEATURES),) by reason, the strongest first."""
    sums: dict[str, float] = {}
    for feature, weight in zip(FEATURES, contributions.tolist(), strict=True):
        sums[feature.reason] = sums.get(feature.reason, 0.0) + weight
    return dict(sorted(sums.items(), key=lambda item: -abs(item[1])))


@cache
def standard_model() -> EvidenceModel:
    """Return the model that comes with the program; ``python -m benchmarks.evidence`` creates it."""
    return EvidenceModel.from_json(json.loads(files("tunneldb.anomalies").joinpath("evidence.json").read_text()))
