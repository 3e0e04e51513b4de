"""How fast a survey is worked off: measured times of its stages, and what follows from them for what is still to be done."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import psycopg

Steps = Sequence[Sequence[tuple[str, dt.datetime | None]]]
"""Of each kilometre the stages that are still to be done, each with when it began, if it has."""


@dataclass(frozen=True)
class Throughput:
    """Times of a survey so far.

    Attributes
    ----------
    mean : mapping
        Mean time that a stage of a kilometre, or the reading of a file (``read``), has taken, s; only of those that were
        done at least once.
    runs : sequence of (datetime, float)
        End of each run that was done, and the time that it took, s.
    """

    mean: Mapping[str, float]
    runs: Sequence[tuple[dt.datetime, float]]

    def knows(self, steps: Steps, to_read: int) -> bool:
        """Whether each stage that is still to be done has been measured."""
        return {stage for row in steps for stage, _ in row} | ({"read"} if to_read else set()) <= self.mean.keys()

    def share(self, steps: Steps, to_read: int, since: dt.datetime) -> float | None:
        """Share of the work since a moment that is done, 0 to 1, each step by its time; None when unknown.

        Parameters
        ----------
        steps, to_read
            What is still to be done: stages of kilometres, and number of files.
        since : datetime
            When it was asked for.
        """
        if not self.knows(steps, to_read):
            return None
        behind = sum(seconds for end, seconds in self.runs if end > since)
        ahead = sum(self.mean[stage] for row in steps for stage, _ in row) + to_read * self.mean.get("read", 0.0)
        return behind / (behind + ahead) if behind + ahead > 0.0 else None

    def left(self, steps: Steps, to_read: int, workers: int, now: dt.datetime) -> float | None:
        """Time that workers need for the rest, s; None when unknown, or when there is no worker.

        It is not less than the longest chain of stages of one kilometre, which are done one after the other.
        """
        if not workers or not self.knows(steps, to_read):
            return None
        chains = [sum(self._rest(stage, began, now) for stage, began in row) for row in steps]
        return max((sum(chains) + to_read * self.mean.get("read", 0.0)) / workers, *chains, 0.0)

    def _rest(self, stage: str, began: dt.datetime | None, now: dt.datetime) -> float:
        return max(self.mean[stage] - ((now - began).total_seconds() if began is not None else 0.0), 0.0)


def measure(conn: psycopg.Connection[Any], survey: str) -> Throughput:
    """Return the throughput of a survey, from its ledger.

    Only runs of a kilometre count, and the reading of a file; loads by ``tunneldb load`` of several files at once do not.
    """
    taken: dict[str, list[float]] = {}
    runs = conn.execute(
        """
        SELECT stage, finished_at, extract(epoch FROM duration)::float8
          FROM tunnel_api.run
         WHERE survey = %s AND outcome = 'done' AND (km IS NOT NULL OR stage = 'read')
        """,
        [survey],
    ).fetchall()
    for stage, _, seconds in runs:
        taken.setdefault(stage, []).append(seconds)
    mean = {stage: sum(seconds) / len(seconds) for stage, seconds in taken.items()}
    return Throughput(mean, [(end, seconds) for _, end, seconds in runs])


def points_per_second(
    conn: psycopg.Connection[Any], survey: str, share: float, since: dt.datetime, now: dt.datetime
) -> float | None:
    """Return the points of the files asked for since a moment that have been brought through, per second.

    Parameters
    ----------
    share : float
        Share of the work that is done, 0 to 1; so much of the points counts as brought through.

    Returns
    -------
    float or None
        None when no file was asked for since.
    """
    row = conn.execute(
        """
        SELECT (SELECT coalesce(sum(points), 0) FROM tunnel_api.incoming WHERE survey = %(survey)s AND state = 'waiting')
             + (SELECT coalesce(sum(points), 0) FROM tunnel_api.file WHERE survey = %(survey)s AND loaded_at >= %(since)s)
        """,
        {"survey": survey, "since": since},
    ).fetchone()
    assert row is not None
    return float(row[0]) * share / (now - since).total_seconds() if row[0] and now > since else None
