"""Probabilities of possible poses of several scans, against counting all combinations."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from tunneldb.registration.underwater import joint
from tunneldb.registration.underwater.chain import Reliefs
from tunneldb.registration.underwater.observations import Pose
from tunneldb.registration.underwater.single import Hypothesis

POSE = Pose(np.eye(3), np.zeros(3), 1.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_chain_of_scans_is_exact(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    sizes = (2, 3, 2)
    own = [np.sort(rng.normal(0.0, 2.0, n))[::-1] for n in sizes]
    links = {(0, 1): rng.normal(0.0, 2.0, (2, 3)), (1, 2): rng.normal(0.0, 2.0, (3, 2)), (0, 2): np.zeros((2, 2))}
    monkeypatch.setattr(joint, "_together", lambda one, other, scans, reliefs: links[scans])
    options = {i: [Hypothesis(POSE, (), float(value)) for value in values] for i, values in enumerate(own)}
    found = joint.probabilities(options, Reliefs({}))
    total = [np.zeros(n) for n in sizes]
    for a, b, c in product(*map(range, sizes)):
        weight = np.exp(own[0][a] + own[1][b] + own[2][c] + links[0, 1][a, b] + links[1, 2][b, c])
        for sums, k in zip(total, (a, b, c), strict=True):
            sums[k] += weight
    for i, sums in enumerate(total):
        assert found[i] == pytest.approx(sums / sums.sum(), abs=1e-4)


def test_what_is_hardly_possible_gets_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint, "_together", lambda one, other, scans, reliefs: np.zeros((len(one), len(other))))
    options = {0: [Hypothesis(POSE, (), 0.0), Hypothesis(POSE, (), -20.0)], 1: [Hypothesis(POSE, (), 0.0)]}
    found = joint.probabilities(options, Reliefs({}))
    assert found[0].tolist() == [1.0, 0.0]
    assert found[1].tolist() == [1.0]


def test_a_certain_neighbour_decides_between_two_equal_poses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint, "_together", lambda one, other, scans, reliefs: np.array([[-3.0, 5.0]]))
    options = {0: [Hypothesis(POSE, ())], 1: [Hypothesis(POSE, ()), Hypothesis(POSE, (), -0.1)]}
    found = joint.probabilities(options, Reliefs({}))
    assert found[1][1] == pytest.approx(1.0 / (1.0 + np.exp(-7.9)), abs=1e-3)
