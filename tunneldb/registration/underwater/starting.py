"""First poses of all scans: from walls, ladders and shared beds, without those that contradict each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.errors import UserError
from tunneldb.registration.underwater.chain import MAX_OVERLAP_DISTANCE, Reliefs, agreement, pose_from_neighbours
from tunneldb.registration.underwater.joint import probabilities
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.single import Hypothesis, PreparedScan, start
from tunneldb.registration.underwater.walls import Walls

MIN_ROUND_SHARE = 0.5  # share of the best log likelihood of a round; less certain scans wait for the next round
MIN_PROBABILITY = 0.99  # of a pose that is taken
MIN_ALTERNATIVE, MAX_ALTERNATIVES = 0.01, 8  # least probability of an alternative; their greatest number


@dataclass(frozen=True)
class FirstPoses:
    """First poses by scan, and of the others why there is none, and the possible poses with their probabilities."""

    started: Mapping[int, Hypothesis]
    reasons: Mapping[int, str]
    alternatives: Mapping[int, Sequence[tuple[Hypothesis, float]]]


def find_first_poses(
    scans: Mapping[int, PreparedScan], walls: Walls, found: Sequence[LaserLadder], *, unseen: bool
) -> FirstPoses:
    """Find first poses by what each scan shows of walls and ladders, and by the beds that they share, as far as possible.

    Parameters
    ----------
    unseen : bool
        True if there are ladders in the water that the laser does not show.

    Raises
    ------
    UserError
        If at least half of the scans that have possible poses are upside down.
    """
    options: dict[int, list[Hypothesis]] = {}
    reasons, upside_down = {}, []
    for i, scan in scans.items():
        try:
            one = start(scan, walls, found)
        except UserError as error:
            upside_down.append(error)
            reasons[i] = "it seems to be upside down"
            continue
        if isinstance(one, list):
            options[i] = one
        else:
            reasons[i] = one.reason
    # a single scan may have confused two ladders
    if upside_down and len(upside_down) >= len(options):
        raise upside_down[0]
    reliefs = Reliefs(scans)
    likely = probabilities(options, reliefs)
    started = {}
    for i, some in options.items():
        best = int(np.argmax(likely[i]))
        on_rock = bool(walls.rough.all()) and not some[best].ladders
        if likely[i][best] < MIN_PROBABILITY:
            reasons[i] = "several poses fit; choose one by --start"
        elif on_rock and scans[i].cloud.near is None:
            reasons[i] = "walls of rock have another plan below the water, and it sees no ladder; choose a pose by --start"
        else:
            started[i] = some[best]
    started = _agreeing(reliefs, started, reasons, walls, unseen=unseen)
    left = [i for i in scans if i not in started]
    placed: dict[int, tuple[Hypothesis, float]] = {}
    new = list(started)
    while new and left:
        for i in left:
            if any(reliefs.may_overlap(k, i) for k in new):
                at = pose_from_neighbours(i, reliefs, started, walls, found)
                placed = {k: one for k, one in placed.items() if k != i} | ({} if at is None else {i: at})
        # less certain, more distant scans may become certain next to the first ones
        highest_likelihood = max((likelihood for _, likelihood in placed.values()), default=0.0)
        new = [i for i, (_, likelihood) in placed.items() if likelihood >= MIN_ROUND_SHARE * highest_likelihood]
        started |= {i: placed.pop(i)[0] for i in new}
        left = [i for i in left if i not in started]
    reasons = {i: reason for i, reason in reasons.items() if i not in started}
    started = _agreeing(reliefs, started, reasons, walls, unseen=unseen)
    alternatives = {i: _likely(some, likely[i]) for i, some in options.items() if i not in started}
    return FirstPoses(started, reasons, alternatives)


def _likely(options: Sequence[Hypothesis], probability: np.ndarray) -> list[tuple[Hypothesis, float]]:
    """Return the possible poses that are worth naming, the most likely first."""
    order = np.argsort(-probability)[:MAX_ALTERNATIVES]
    return [(options[k], float(probability[k])) for k in order if probability[k] >= MIN_ALTERNATIVE]


def _agreeing(
    reliefs: Reliefs,
    started: Mapping[int, Hypothesis],
    reasons: dict[int, str],
    walls: Walls,
    *,
    unseen: bool,
) -> dict[int, Hypothesis]:
    """Return the scans that do not contradict each other where they see the same bed, since ladders look alike.

    ``reasons`` gets the reasons for the others. With ``unseen`` ladders, a scan that sees only one may have confused it with
    one of these: its pose needs confirmation by the plan, by another scan, or by the place given by the operator.
    """
    kept = dict(started)
    agreements = {
        (a, b): agreement(a, b, (started[a].pose, started[b].pose), reliefs, walls)
        for a in started
        for b in started
        if a < b and np.linalg.norm(started[a].pose.translation - started[b].pose.translation) < MAX_OVERLAP_DISTANCE
    }

    def votes(i: int) -> tuple[int, int]:
        of = [value for (a, b), value in agreements.items() if i in (a, b) and a in kept and b in kept]
        return of.count(1), of.count(-1)

    while kept:
        against = {i: votes(i) for i in kept if votes(i)[1]}
        if not against:
            break
        worst = min(for_it - no for for_it, no in against.values())
        for i in [i for i, (for_it, no) in against.items() if for_it - no == worst]:
            del kept[i]
            reasons[i] = "its bed differs from the bed that other scans show there"
    if unseen:
        unconfirmed = {i: one for i, one in kept.items() if len(one.ladders) < 2 and not one.by_plan}
        alone = [i for i in unconfirmed if reliefs.scans[i].cloud.near is None]
        for i in [i for i in alone if not votes(i)[0]]:
            del kept[i]
            reasons[i] = "it sees only one ladder, which may be one that the laser does not show; give its place by --start"
    return kept
