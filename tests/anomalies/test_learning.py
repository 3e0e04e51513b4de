"""What reviews teach the model of evidence: known adjustments are found again, chance is not learned."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.anomalies.evidence import EvidenceModel, standard_model
from tunneldb.anomalies.features import FEATURES, NAMES
from tunneldb.anomalies.learning import (
    FOLDS,
    MIN_REVIEWS,
    REASONS,
    STRETCH_LENGTH,
    Adjustment,
    Reviewed,
    folds,
    learn,
    losses,
    stretches,
)
from tunneldb.anomalies.verdict import OUTLINE_REASONS, weigh

STEPS = np.linspace(-1.5, 1.5, 7)
SPEAKING = [next(k for k, feature in enumerate(FEATURES) if feature.reason == reason) for reason in REASONS]
"""Of each reason the feature that the stairs ask for."""


@pytest.fixture(scope="module")
def stairs() -> EvidenceModel:
    """A model in which each reason adds from -1.4 to 1.4, in steps of a feature of its own."""
    trees = [(feature, step) for feature in SPEAKING for step in STEPS]
    roots = 3 * np.arange(len(trees))
    own = np.arange(3 * len(trees))
    feature, threshold = np.zeros(len(own), np.intp), np.zeros(len(own))
    feature[roots], threshold[roots] = np.array([f for f, _ in trees]), [step for _, step in trees]
    left, right, value = own.copy(), own.copy(), np.zeros(len(own))
    left[roots], right[roots], value[roots + 1], value[roots + 2] = roots + 1, roots + 2, -0.2, 0.2
    return EvidenceModel("stairs", -0.5, roots, feature, threshold, np.zeros(len(own), np.bool_), left, right, value, {})


def drawn(model: EvidenceModel, count: int, seed: int, truth: Adjustment | None = None) -> Reviewed:
    """Reviews by chance, with the probabilities of a model, or of one that is adjusted."""
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(count, len(FEATURES)))
    true = model if truth is None else truth.apply(model, "true")
    leak = rng.random(count) < true.probabilities(features)
    return Reviewed(features, np.ones(count), leak, np.ones(count, np.int64), rng.uniform(0, 20.0 * count, count))


def test_a_slope_and_an_offset_are_found_again(stairs: EvidenceModel) -> None:
    lesson = learn(stairs, drawn(stairs, 6000, 1, Adjustment("recalibrated", 0.5, -1.0)))
    assert lesson.adjustment.way == "recalibrated"
    assert lesson.adjustment.slope == pytest.approx(0.5, abs=0.04)
    assert lesson.adjustment.offset == pytest.approx(-1.0, abs=0.1)
    assert [one.way for one in lesson.held_out] == ["base", "recalibrated", "refit", "extended"]
    assert lesson.held_out[1].loss < lesson.held_out[0].loss


def test_a_reason_that_says_nothing_there_no_longer_counts(stairs: EvidenceModel) -> None:
    truth = Adjustment("refit", 1.0, 0.3, {"faint": 0.0, "salts": 2.0})
    adjustment = learn(stairs, drawn(stairs, 3000, 2, truth)).adjustment
    assert adjustment.way == "refit"
    assert adjustment.factors["faint"] < 0.15
    assert adjustment.factors["salts"] == pytest.approx(2.0, abs=0.3)
    others = [factor for reason, factor in adjustment.factors.items() if reason not in ("faint", "salts")]
    assert np.abs(np.array(others) - 1.0).max() < 0.25
    assert adjustment.offset == pytest.approx(0.3, abs=0.15)


def test_what_the_trees_do_not_ask_is_learned(stairs: EvidenceModel) -> None:
    """Leaks are such by a feature that no tree asks for, too: what each scale of it is worth is found again."""
    silent = next(k for k in range(len(FEATURES)) if k not in SPEAKING and FEATURES[k].reason == "rectangular")
    truth = Adjustment("extended", 1.0, -0.4, {}, {NAMES[silent]: (0.0, 1.0, -1.5)})
    adjustment = learn(stairs, drawn(stairs, 3000, 7, truth)).adjustment
    assert adjustment.way == "extended"
    centre, scale, weight = adjustment.terms[NAMES[silent]]
    assert (centre, scale) == (pytest.approx(0.0, abs=0.1), pytest.approx(1.0, abs=0.1))
    assert weight == pytest.approx(-1.5, abs=0.25)
    others = [term[2] for name, term in adjustment.terms.items() if name != NAMES[silent]]
    assert np.abs(others).mean() < 0.1


def test_a_feature_that_could_not_be_measured_says_nothing_of_its_own(stairs: EvidenceModel) -> None:
    features = np.zeros((2, len(FEATURES)))
    features[1] = np.nan
    own = Adjustment("extended", 1.0, 0.0, {}, dict.fromkeys(NAMES, (0.0, 1.0, 0.5))).apply(stairs, "x")
    assert (own.contributions(features) == stairs.contributions(features)).all()
    far = np.full((1, len(FEATURES)), 1e6)
    assert own.contributions(far) == pytest.approx(stairs.contributions(far) + 3.0 * 0.5)


@pytest.mark.parametrize("leak", [True, False])
def test_fewer_reviews_than_tell_anything_change_nothing(stairs: EvidenceModel, leak: bool) -> None:
    reviewed = drawn(stairs, MIN_REVIEWS - 1, 3)
    contrary = Reviewed(reviewed.features, reviewed.outline, np.full(MIN_REVIEWS - 1, leak), reviewed.tunnel, reviewed.chainage)
    lesson = learn(stairs, contrary)
    assert lesson.adjustment == Adjustment()
    assert [one.way for one in lesson.held_out] == ["base"]


def test_few_reviews_change_little(stairs: EvidenceModel) -> None:
    """Of 20 reviews that are as the model says, chance makes little of."""
    fresh = drawn(stairs, 500, 99)
    before = stairs.probabilities(fresh.features)
    moved = []
    for seed in range(15):
        adjusted = learn(stairs, drawn(stairs, 20, seed)).adjustment.apply(stairs, "learned")
        moved.append(float(np.abs(adjusted.probabilities(fresh.features) - before).mean()))
    assert np.mean(np.array(moved) == 0.0) > 0.7
    assert np.mean(moved) < 0.02
    assert max(moved) < 0.15


@pytest.mark.parametrize("count", [20, 60, 200])
def test_what_was_learned_is_never_worse_on_reviews_held_out(stairs: EvidenceModel, count: int) -> None:
    for seed in range(4):
        lesson = learn(stairs, drawn(stairs, count, seed))
        chosen = next(one for one in lesson.held_out if one.way == lesson.adjustment.way)
        assert chosen.loss <= lesson.held_out[0].loss


def test_where_there_is_nothing_to_learn_little_is_lost_elsewhere(stairs: EvidenceModel) -> None:
    fresh = drawn(stairs, 4000, 98)

    def loss(model: EvidenceModel) -> float:
        odds = model.constant + model.contributions(fresh.features).sum(axis=1)
        return float(losses(odds, fresh.leak).mean())

    worse = [loss(learn(stairs, drawn(stairs, 100, seed)).adjustment.apply(stairs, "learned")) for seed in range(8)]
    assert np.mean(worse) - loss(stairs) < 0.015


def test_neighbours_are_in_one_part() -> None:
    rng = np.random.default_rng(4)
    tunnel, chainage = rng.integers(1, 3, 300), rng.uniform(-500, 500, 300)
    stretch = stretches(tunnel, chainage)
    part = folds(stretch)
    assert set(part.tolist()) == set(range(FOLDS))
    for number in range(stretch.max() + 1):
        here = stretch == number
        assert np.ptp(chainage[here]) <= STRETCH_LENGTH
        assert len(set(tunnel[here].tolist())) == len(set(part[here].tolist())) == 1
    order = np.lexsort([chainage, tunnel])
    assert (np.diff(part[order]) >= 0).all()  # parts follow each other along the tunnels
    assert np.bincount(part).min() > 40


def test_reviews_of_one_place_teach_nothing(stairs: EvidenceModel) -> None:
    reviewed = drawn(stairs, 60, 5, Adjustment("recalibrated", 1.0, -4.0))
    one = Reviewed(reviewed.features, reviewed.outline, reviewed.leak, reviewed.tunnel, np.full(60, 12.0))
    assert learn(stairs, one).adjustment.way == "base"


def test_an_adjusted_model_says_what_the_adjustment_states() -> None:
    model = standard_model()
    rng = np.random.default_rng(6)
    features = rng.normal(size=(20, len(FEATURES)))
    adjustment = Adjustment("refit", 1.0, 0.7, {"faint": 0.5})
    adjusted = Adjustment.from_json("refit", adjustment.to_json()).apply(model, "learned 3")
    assert adjusted.version == f"{model.version}+learned 3"
    assert adjusted.constant == model.constant + 0.7
    plain, changed = model.contributions(features), adjusted.contributions(features)
    faint = np.array([feature.reason == "faint" for feature in FEATURES])
    assert changed[:, faint] == pytest.approx(0.5 * plain[:, faint])
    assert (changed[:, ~faint] == plain[:, ~faint]).all()
    recalibrated = Adjustment("recalibrated", 0.8, -0.2).apply(model, "x")
    odds = model.constant + plain.sum(axis=1)
    assert recalibrated.constant + recalibrated.contributions(features).sum(axis=1) == pytest.approx(0.8 * odds - 0.2)


def test_reasons_by_outlines_that_tell_less_weigh_less(stairs: EvidenceModel) -> None:
    features = np.ones((2, len(FEATURES)))
    whole, half = weigh(stairs, features, np.array([1.0, 0.5]))
    for k, feature in enumerate(FEATURES):
        assert half[k] == whole[k] * (0.5 if feature.reason in OUTLINE_REASONS else 1.0), NAMES[k]
