"""Fit the model of evidence by boosting, and judge tunnels by models of others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from sklearn.ensemble import HistGradientBoostingClassifier

from tunneldb.anomalies.evidence import EvidenceModel
from tunneldb.anomalies.features import FEATURES

Array = NDArray[np.float64]

DIGITS = 5
"""Of what is stored."""

GROWS = {
    "contrast", "drop", "water", "certain", "width", "waviness", "step", "far_step", "box_waviness", "taper", "support",
}  # fmt: skip
FALLS = {
    "line", "recess", "recess_rim", "straight", "box", "corners", "turned_box", "beside", "alike", "thin_degree",
    "uneven", "recess_degree", "gradual_degree", "rectangular_degree", "stripe_degree", "shadow_degree",
}  # fmt: skip
"""Features with which the odds of a leak can only grow or fall, as physics has it: none is learnt the wrong way round."""


def boosted(rounds: int) -> HistGradientBoostingClassifier:
    """Boosting of small trees, each of which looks at half of the features."""
    signs = [1 if feature.name in GROWS else -1 if feature.name in FALLS else 0 for feature in FEATURES]
    return HistGradientBoostingClassifier(
        learning_rate=0.05, max_iter=rounds, max_leaf_nodes=8, min_samples_leaf=20, l2_regularization=5.0, max_features=0.5,
        monotonic_cst=signs, early_stopping=False, random_state=1,
    )  # fmt: skip


def fit_model(
    features: Array, leak: NDArray[np.bool_], weights: Array, rounds: int, version: str, notes: dict[str, Any]
) -> EvidenceModel:
    """Fit the trees; they ask for no feature that none of the regions has."""
    features = np.where(np.isnan(features).all(axis=0), 0.0, features)
    machine = boosted(rounds).fit(features, leak, sample_weight=weights)
    trees = [trees[0].nodes for trees in machine._predictors]  # the only way to its nodes
    roots = np.concatenate([[0], np.cumsum([len(tree) for tree in trees])[:-1]]).astype(np.intp)
    nodes = np.concatenate(trees)
    own, first = np.arange(len(nodes)), np.repeat(roots, [len(tree) for tree in trees])
    leaf = nodes["is_leaf"].astype(bool)
    value = np.concatenate([_means(tree) for tree in trees])
    return EvidenceModel(
        version,
        round(float(machine._baseline_prediction[0, 0]) + float(value[roots].sum()), DIGITS),
        roots,
        np.where(leaf, 0, nodes["feature_idx"]).astype(np.intp),
        np.where(leaf, 0.0, nodes["num_threshold"]),
        nodes["missing_go_to_left"].astype(bool) & ~leaf,
        np.where(leaf, own, first + nodes["left"]).astype(np.intp),
        np.where(leaf, own, first + nodes["right"]).astype(np.intp),
        np.round(value, DIGITS),
        notes,
    )


def _means(tree: Any) -> Array:
    """Mean of the ends below each node, by how many regions came to each; ends stand behind what leads to them."""
    value = np.where(tree["is_leaf"], tree["value"], 0.0)
    for k in range(len(tree) - 1, -1, -1):
        if not tree["is_leaf"][k]:
            ends = np.array([tree["left"][k], tree["right"][k]])
            value[k] = np.average(value[ends], weights=np.maximum(tree["count"][ends], 1))
    return value


def left_out(
    features: Array,
    leak: NDArray[np.bool_],
    weights: Array,
    groups: NDArray[np.object_],
    fit: Callable[..., Callable[[Array], Array]],
) -> Array:
    """Probabilities (n,) of the regions of each group by a model fitted to all others."""
    out = np.full(len(leak), np.nan)
    for group in np.unique(groups):
        held = groups == group
        out[held] = fit(features[~held], leak[~held], weights[~held])(features[held])
    return out


def loss(probabilities: Array, leak: NDArray[np.bool_], weights: Array) -> float:
    """Mean negative logarithm of the probability of what was true."""
    p = np.clip(np.where(leak, probabilities, 1.0 - probabilities), 1e-6, 1.0)
    return float(-(weights * np.log(p)).sum() / weights.sum())


def temperature(probabilities: Array, leak: NDArray[np.bool_], weights: Array) -> float:
    """Return the divisor of log odds for calibrated probabilities on left-out tunnels (Guo et al., 2017)."""
    p = np.clip(probabilities, 1e-9, 1.0 - 1e-9)
    odds = np.log(p / (1.0 - p))
    found = minimize_scalar(lambda t: loss(1.0 / (1.0 + np.exp(-odds / t)), leak, weights), bounds=(0.5, 5.0), method="bounded")
    return float(found.x)


def cooled(model: EvidenceModel, by: float) -> EvidenceModel:
    """Divide the logarithms of odds of a model by a temperature."""
    return replace(model, constant=round(model.constant / by, DIGITS), value=np.round(model.value / by, DIGITS))


def weights_of(scenes: NDArray[np.object_], most: float = 60.0) -> Array:
    """Weight of each region: no tunnel counts as more than so many regions."""
    _, place, count = np.unique(scenes.astype(str), return_inverse=True, return_counts=True)
    return np.minimum(1.0, most / count)[place]
