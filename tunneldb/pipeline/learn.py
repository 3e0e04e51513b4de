"""Learn from reviews: the adjusted model of evidence and its effects; apply and undo."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg

from tunneldb.anomalies.evidence import EvidenceModel, standard_model
from tunneldb.anomalies.features import NAMES
from tunneldb.anomalies.learning import Lesson, Reviewed, learn
from tunneldb.anomalies.verdict import kind_of, weigh
from tunneldb.arrays import Bool, Float
from tunneldb.counted import counted
from tunneldb.errors import NotReadyError, UserError
from tunneldb.store.learned import (
    Measured,
    apply_learned,
    load_measured,
    model_in_force,
    places_of,
    surveys_of,
    undo_learned,
)
from tunneldb.store.survey import Survey, get_survey

MAX_LISTED_CHANGES = 10
"""Maximum number of listed changes."""


@dataclass(frozen=True)
class Change:
    """A finding that detection would classify otherwise.

    Attributes
    ----------
    id : int
    survey, label : str
        Place of the finding.
    was, will_be : str
        leak, joint or dark.
    before, after : float
        Probability that it is a leak.
    """

    id: int
    survey: str
    label: str
    was: str
    will_be: str
    before: float
    after: float


@dataclass(frozen=True)
class Changes:
    """Number of findings of a survey that would be of another kind.

    Attributes
    ----------
    survey : str
    anomalies : int
        Findings of the last detection with features.
    to_leak, from_leak : int
    """

    survey: str
    anomalies: int
    to_leak: int
    from_leak: int


@dataclass(frozen=True)
class Unused:
    """Numbers of reviewed findings of a survey that nothing can be learned from, because they have no features.

    Attributes
    ----------
    detected : int
        Found by a version that did not store the features: detection stores them when it runs again.
    gone : int
        The same, but the last detection did not find them any more.
    drawn : int
        Drawn, redrawn, split or merged by people: detection does not measure them, unless it finds them, too.
    """

    detected: int
    gone: int
    drawn: int


@dataclass(frozen=True)
class Plan:
    """Result of learning, and its effects.

    Attributes
    ----------
    tunnels : mapping
        Names of the tunnels that it is for, by their keys.
    surveys : sequence of str
        Surveys whose reviews were used.
    lesson : Lesson
    reviews : mapping
        Number of used reviews of each sort.
    unused : mapping
        Reviewed findings without features, by survey.
    changes : sequence of Changes
        Changes in all surveys of the tunnels, compared with the current model.
    largest : sequence of Change
        The largest changes of probability, MAX_LISTED_CHANGES at the most, those to another kind first.
    """

    tunnels: Mapping[int, str]
    surveys: Sequence[str]
    lesson: Lesson
    reviews: Mapping[str, int]
    unused: Mapping[str, Unused]
    changes: Sequence[Changes]
    largest: Sequence[Change]

    @property
    def loss(self) -> float:
        """Return the mean loss on held-out reviews of the chosen adjustment."""
        way = self.lesson.adjustment.way
        return next(one.loss for one in self.lesson.held_out if one.way == way)


def get_surveys(conn: psycopg.Connection[Any], names: Sequence[str]) -> list[Survey]:
    """Return the surveys of these names, without duplicates."""
    return [get_survey(conn, name) for name in dict.fromkeys(names)]


def plan_learning(conn: psycopg.Connection[Any], surveys: Sequence[Survey]) -> Plan:
    """Learn from the reviews of surveys, and find what it would change in their tunnels; nothing is written.

    Raises
    ------
    UserError
        If nothing was reviewed, or of nothing that was reviewed the features are stored.
    """
    tunnels = {survey.tunnel_id: survey.tunnel for survey in surveys}
    names = [survey.name for survey in surveys]
    measured = load_measured(conn, tunnels)
    reviewed = (measured.said != "") & np.isin(measured.survey, [survey.id for survey in surveys])
    unused = {survey.name: _unused(measured, reviewed & (measured.survey == survey.id)) for survey in surveys}
    if not reviewed.any():
        raise NotReadyError(
            f"no finding of {' or '.join(names)} was reviewed yet: confirm, reject or rename some, in QGIS or through the view"
            " tunnel_api.leak"
        )
    used = reviewed & measured.known
    if not used.any():
        raise UserError("; ".join(no_features(unused)))
    lesson = learn(standard_model(), _reviewed(measured, used))
    sorts = Counter(measured.said[used].tolist())
    changes, largest = _changes(conn, measured, lesson, tunnels)
    return Plan(tunnels, names, lesson, dict(sorted(sorts.items())), unused, changes, largest)


def no_features(unused: Mapping[str, Unused]) -> list[str]:
    """Return which surveys have reviewed findings without features, and what to do, a line for each survey and reason."""
    lines = []
    for survey, one in unused.items():
        if one.detected:
            lines.append(f"{_counted(survey, one.detected)} no features: run detect again: tunneldb run {survey} --from detect")
        if one.gone:
            lines.append(f"{_counted(survey, one.gone)} no features and were not found again by the last detection: not used")
        if one.drawn:
            lines.append(
                f"{_counted(survey, one.drawn)} an outline drawn by hand, which has no features: not used; detection learns"
                " from detected findings that you confirm, reject or rename"
            )
    return lines


def _counted(survey: str, count: int) -> str:
    return f"{survey}: {counted(count, 'reviewed finding has', 'reviewed findings have')}"


def _unused(measured: Measured, reviewed: Bool) -> Unused:
    without = reviewed & ~measured.known
    drawn = without & measured.drawn
    again = without & ~measured.drawn & measured.detected
    return Unused(int(again.sum()), int((without & ~drawn & ~again).sum()), int((drawn & ~measured.covered).sum()))


def apply_plan(conn: psycopg.Connection[Any], plan: Plan, note: str | None) -> dict[str, int]:
    """Activate the adjustment for each tunnel of a plan; return its numbers by tunnel, none if nothing was learned."""
    adjustment = plan.lesson.adjustment
    if adjustment.way == "base":
        return {}
    losses = plan.lesson.held_out[0].loss, plan.loss
    return {
        tunnel: apply_learned(conn, key, adjustment, plan.surveys, plan.reviews, losses, note)
        for key, tunnel in plan.tunnels.items()
    }


def undo_learning(conn: psycopg.Connection[Any], surveys: Sequence[Survey]) -> dict[str, int]:
    """Undo the last adjustment for the tunnels of surveys; return its numbers by tunnel.

    Raises
    ------
    UserError
        If one of them has no adjustment.
    """
    undone = {}
    for key, tunnel in {survey.tunnel_id: survey.tunnel for survey in surveys}.items():
        number = undo_learned(conn, key)
        if number is None:
            raise UserError(f"tunnel {tunnel} has no adjustment from reviews: there is nothing to undo")
        undone[tunnel] = number
    return undone


def _reviewed(measured: Measured, rows: Bool) -> Reviewed:
    return Reviewed(
        measured.features[rows], measured.outline[rows], measured.leak[rows], measured.tunnel[rows], measured.chainage[rows]
    )


def _changes(
    conn: psycopg.Connection[Any], measured: Measured, lesson: Lesson, tunnels: Mapping[int, str]
) -> tuple[list[Changes], list[Change]]:
    """Return findings that would be classified differently than now."""
    new = lesson.adjustment.apply(standard_model(), "learned")
    before = np.full(len(measured.id), np.nan)
    for tunnel in tunnels:
        here = measured.tunnel == tunnel
        before[here] = _probabilities(model_in_force(conn, tunnel).model, measured, here)
    after = _probabilities(new, measured, np.ones(len(measured.id), np.bool_))
    judged = measured.known & measured.detected & ~measured.crossed
    to_leak, from_leak = judged & (before < 0.5) & (after >= 0.5), judged & (before >= 0.5) & (after < 0.5)
    counts = [
        Changes(name, *(int((rows & (measured.survey == key)).sum()) for rows in (judged, to_leak, from_leak)))
        for key, name in surveys_of(conn, tunnels).items()
    ]
    moved = np.where(judged, np.abs(after - before), 0.0) + (to_leak | from_leak)
    first = [k for k in np.argsort(-moved, kind="stable")[:MAX_LISTED_CHANGES].tolist() if moved[k] > 0.005]
    places = places_of(conn, measured.id[first].tolist())
    line = measured.features[:, NAMES.index("line")] >= 0.5

    def kind(k: int, p: Float) -> str:
        return kind_of(float(p[k]), line=bool(line[k]))

    return counts, [
        Change(
            int(measured.id[k]),
            *places[int(measured.id[k])],
            kind(k, before),
            kind(k, after),
            float(before[k]),
            float(after[k]),
        )
        for k in first
    ]


def _probabilities(model: EvidenceModel, measured: Measured, rows: Bool) -> Float:
    """Return probabilities of leaks; NaN without features."""
    odds = model.constant + weigh(model, measured.features[rows], measured.outline[rows]).sum(axis=1)
    return np.asarray(np.where(measured.known[rows], 1.0 / (1.0 + np.exp(-odds)), np.nan))
