"""The model of evidence: probabilities, what features add to them, and its trees as a file."""

import json
import math
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from support.benchmark_files import load_benchmark

from tunneldb.anomalies.evidence import EvidenceModel, reasons_of, standard_model
from tunneldb.anomalies.features import FEATURES, NAMES

ANY = arrays(float, (5, len(FEATURES)), elements=st.floats(-20, 20) | st.just(math.nan))


def fitting() -> ModuleType:
    """The program that fits the model; what it needs takes seconds to import."""
    return load_benchmark("evidence/fit.py")


def grown(sign: int, features: np.ndarray, names: set[str]) -> np.ndarray:
    """The same regions, of which some features are greater by 1."""
    return features + sign * np.isin(NAMES, list(names))


@pytest.mark.slow
def test_trees_are_those_of_the_library_that_fitted_them() -> None:
    rng = np.random.default_rng(3)
    features = rng.normal(0, 2, (900, len(FEATURES)))
    features[rng.random(features.shape) < 0.1] = np.nan
    leak = np.nan_to_num(features[:, 0]) + np.nan_to_num(features[:, 3]) ** 2 + rng.normal(0, 1, 900) > 3
    weights = rng.uniform(0.2, 1.0, 900)
    fit = fitting()
    ours = fit.fit_model(features, leak, weights, 40, "few", {})
    theirs = fit.boosted(40).fit(features, leak, sample_weight=weights)
    np.testing.assert_allclose(ours.probabilities(features), theirs.predict_proba(features)[:, 1], atol=5e-4)


@given(features=ANY)
def test_probabilities_are_of_the_sum_of_what_the_features_add(features: np.ndarray) -> None:
    model = standard_model()
    p = model.probabilities(features)
    assert np.all((p > 0) & (p < 1))
    added = model.contributions(features)
    np.testing.assert_allclose(np.log(p / (1 - p)), model.constant + added.sum(axis=1), atol=1e-9)
    for row in added:
        reasons = reasons_of(row)
        assert sum(reasons.values()) == pytest.approx(row.sum())
        assert [abs(weight) for weight in reasons.values()] == sorted(map(abs, reasons.values()), reverse=True)


@given(features=ANY)
def test_darker_is_never_less_probable_and_what_looks_built_never_more(features: np.ndarray) -> None:
    model = standard_model()
    p = model.probabilities(features)
    assert np.all(model.probabilities(grown(1, features, {"contrast", "drop", "width", "support"})) >= p - 1e-9)
    assert np.all(model.probabilities(grown(1, features, {"straight", "box", "line", "beside", "alike"})) <= p + 1e-9)
    assert np.all(model.probabilities(grown(1, features, {"gradual_degree", "recess_degree", "shadow_degree"})) <= p + 1e-9)


def test_a_model_is_the_same_from_its_file_and_another_format_is_refused() -> None:
    model = standard_model()
    values = json.loads(json.dumps(model.to_json()))
    again = EvidenceModel.from_json(values)
    features = np.random.default_rng(1).normal(0, 3, (50, len(FEATURES)))
    np.testing.assert_array_equal(again.probabilities(features), model.probabilities(features))
    assert again.version == model.version
    with pytest.raises(ValueError, match="format 1"):
        EvidenceModel.from_json({**values, "format": 1})
    with pytest.raises(ValueError, match=r"unsupported trees: format .*features"):
        EvidenceModel.from_json({**values, "features": list(NAMES[1:])})


def test_the_model_that_comes_with_the_program_is_small_and_says_what_it_was_fitted_to() -> None:
    values = standard_model().to_json()
    assert len(json.dumps(values)) < 150_000
    assert {"regions", "rounds"} <= set(values["trained_on"])
