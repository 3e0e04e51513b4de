"""Possible poses of all scans together: a pose is more likely if its bed is the bed that other scans show there.

Sum-product belief propagation on the scans that may overlap (Pearl, 1988): exact for a chain of scans.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import logsumexp

from tunneldb.arrays import Float
from tunneldb.registration.underwater.chain import MAX_OVERLAP_DISTANCE, Reliefs, direction_of
from tunneldb.registration.underwater.single import Hypothesis

MIN_LOG_ODDS = float(np.log(1e-4))  # of hypotheses that are followed
MAX_EVIDENCE = float(np.log(1000.0))  # of one pair of scans
ROUNDS = 20


def probabilities(options: Mapping[int, Sequence[Hypothesis]], reliefs: Reliefs) -> dict[int, Float]:
    """Return the probability of each hypothesis of each scan, from their own odds and the beds that scans share.

    Hypotheses less likely than MIN_LOG_ODDS by themselves get 0.
    """
    own = {i: np.array([one.log_odds for one in some]) for i, some in options.items()}
    live = {i: np.flatnonzero(odds >= odds.max() + MIN_LOG_ODDS).tolist() for i, odds in own.items()}
    links: dict[tuple[int, int], Float] = {}
    for i in options:
        for j in options:
            if i < j and (len(live[i]) > 1 or len(live[j]) > 1):
                table = _together([options[i][k] for k in live[i]], [options[j][k] for k in live[j]], (i, j), reliefs)
                if np.ptp(table) > 0.0:
                    links[i, j], links[j, i] = table, table.T
    messages = {(i, j): np.zeros(len(live[j])) for i, j in links}
    for _ in range(ROUNDS if links else 0):
        new = {}
        for i, j in links:
            arriving = own[i][live[i]] + sum((messages[k, m] for k, m in links if m == i and k != j), np.zeros(len(live[i])))
            out = logsumexp(arriving[:, None] + links[i, j], axis=0)
            new[i, j] = 0.5 * (out - out.max()) + 0.5 * messages[i, j]
        messages = new
    found = {}
    for i, some in options.items():
        belief = own[i][live[i]] + sum((messages[k, m] for k, m in links if m == i), np.zeros(len(live[i])))
        found[i] = np.zeros(len(some))
        found[i][live[i]] = np.exp(belief - logsumexp(belief))
    return found


def _together(one: Sequence[Hypothesis], other: Sequence[Hypothesis], scans: tuple[int, int], reliefs: Reliefs) -> Float:
    """Return the log likelihood ratio of one bed to two, for each pair of hypotheses of two scans."""
    i, j = scans
    table = np.zeros((len(one), len(other)))
    for a, first in enumerate(one):
        look = direction_of(reliefs.scans[i], first.pose)
        for b, second in enumerate(other):
            apart = (second.pose.translation - first.pose.translation)[:2]
            if np.linalg.norm(apart) < MAX_OVERLAP_DISTANCE:
                same = float(look @ direction_of(reliefs.scans[j], second.pose)) > 0.0
                near = reliefs.near(i, j, float(apart @ look), turned=not same)
                table[a, b] = float(np.clip(near.max(), -MAX_EVIDENCE, MAX_EVIDENCE))
    return table
