"""The model of evidence: probabilities, what features add to them, and its tables as a file."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tunneldb.anomalies.evidence import KINDS, EvidenceModel, reasons_of, standard_model
from tunneldb.anomalies.features import FEATURES

FEW = EvidenceModel(
    "few",
    np.array([0.5, 0.0, -0.5]),
    (np.array([1.0, 2.0]), *(np.empty(0) for _ in FEATURES[1:])),
    (np.array([[1.0, 0, 0], [2.0, 0, 0], [3.0, 0, 0], [-4.0, 0, 0]]), *(np.zeros((2, 3)) for _ in FEATURES[1:])),
    {},
)


@pytest.mark.parametrize(
    ("value", "score"), [(0.0, 1.0), (1.0, 1.0), (1.1, 2.0), (2.0, 2.0), (2.1, 3.0), (np.inf, 3.0), (math.nan, -4.0)]
)
def test_a_value_on_a_limit_belongs_to_the_class_below_and_what_is_unknown_to_a_class_of_its_own(value, score):
    features = np.zeros((1, len(FEATURES)))
    features[0, 0] = value
    assert FEW.contributions(features)[0, 0, 0] == score
    powers = np.exp([0.5 + score, 0.0, -0.5])
    np.testing.assert_allclose(FEW.probabilities(features)[0], powers / powers.sum())


@given(features=arrays(float, (5, len(FEATURES)), elements=st.floats(-20, 20) | st.just(math.nan)))
def test_probabilities_are_of_the_sum_of_what_the_features_add(features):
    model = standard_model()
    p = model.probabilities(features)
    assert np.all(p > 0)
    np.testing.assert_allclose(p.sum(axis=1), 1.0)
    added = model.contributions(features)
    odds = (model.constant[0] - model.constant[2]) + (added[:, :, 0] - added[:, :, 2]).sum(axis=1)
    np.testing.assert_allclose(np.log(p[:, 0] / p[:, 2]), odds, atol=1e-9)
    for row, of_one in zip(added, odds, strict=True):
        reasons = reasons_of(row, 0, 2)
        assert sum(reasons.values()) + model.constant[0] - model.constant[2] == pytest.approx(of_one)
        assert [abs(weight) for weight in reasons.values()] == sorted(map(abs, reasons.values()), reverse=True)


def test_a_model_is_the_same_from_its_file():
    model = standard_model()
    again = EvidenceModel.from_json(json.loads(json.dumps(model.to_json())))
    features = np.random.default_rng(1).normal(0, 3, (50, len(FEATURES)))
    np.testing.assert_array_equal(again.probabilities(features), model.probabilities(features))
    assert again.version == model.version


def test_a_feature_that_a_file_lacks_says_nothing_and_another_format_is_refused():
    values = FEW.to_json()
    del values["features"][FEATURES[0].name]
    assert not EvidenceModel.from_json(values).contributions(np.ones((1, len(FEATURES)))).any()
    with pytest.raises(ValueError, match="format 2"):
        EvidenceModel.from_json({**values, "format": 2})


def test_tables_are_small_and_of_all_features():
    values = standard_model().to_json()
    assert list(values["features"]) == [feature.name for feature in FEATURES]
    assert values["kinds"] == list(KINDS)
    assert len(json.dumps(values)) < 50_000
