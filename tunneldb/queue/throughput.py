"""Throughput of a survey: measured times of its stages, and the time for the remaining work."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import psycopg

Steps = Sequence[Sequence[tuple[str, dt.datetime | None]]]
"""Remaining stages of each kilometre, each with its start time, if it has begun."""


@dataclass(frozen=True)
class Throughput:
    """Measured times of a survey.

    Attributes
    ----------
    mean : mapping
        Mean time of a stage of a kilometre, or of reading a file (``read``), s; only for stages completed at least once.
    runs : sequence of (datetime, float)
        End of each completed run, and its duration, s.
    """

    mean: Mapping[str, float]
    runs: Sequence[tuple[dt.datetime, float]]

    def knows(self, steps: Steps, to_read: int) -> bool:
        """Return True if each remaining stage has been measured."""
        return {stage for row in steps for stage, _ in row} | ({"read"} if to_read else set()) <= self.mean.keys()

    def share(self, steps: Steps, to_read: int, since: dt.datetime) -> float | None:
        """Return the share of the work since a moment that is complete, 0 to 1, weighted by time; None if unknown.

        Parameters
        ----------
        steps, to_read
            Remaining work: stages of kilometres, and number of files.
        since : datetime
            Time of the request.
        """
        if not self.knows(steps, to_read):
            return None
        behind = sum(seconds for end, seconds in self.runs if end > since)
        ahead = sum(self.mean[stage] for row in steps for stage, _ in row) + to_read * self.mean.get("read", 0.0)
        return behind / (behind + ahead) if behind + ahead > 0.0 else None

    def left(self, steps: Steps, to_read: int, workers: int, now: dt.datetime) -> float | None:
        """Return the remaining time, s; None if unknown, or if there is no worker.

        It is at least the longest chain of stages of one kilometre, which run one after the other.
        """
        if not workers or not self.knows(steps, to_read):
            return None
        chains = [sum(self._rest(stage, began, now) for stage, began in row) for row in steps]
        return max((sum(chains) + to_read * self.mean.get("read", 0.0)) / workers, *chains, 0.0)

    def _rest(self, stage: str, began: dt.datetime | None, now: dt.datetime) -> float:
        return max(self.mean[stage] - ((now - began).total_seconds() if began is not None else 0.0), 0.0)


def measure(conn: psycopg.Connection[Any], survey: str) -> Throughput:
    """Return the throughput of a survey, from its ledger.

    Only runs of a kilometre, and the reading of a file, are included; ``tunneldb load`` of several files at once is not.
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
    """Return the completed points per second, of the files requested since a moment.

    Parameters
    ----------
    share : float
        Share of the work that is complete, 0 to 1; the same share of the points counts as complete.

    Returns
    -------
    float or None
        None if no file was requested since then.
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
