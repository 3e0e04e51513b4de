"""A stage: what it reads, what it depends on, and the function that does it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import psycopg

    from tunneldb.store.survey import Survey

Counts = dict[str, Any]
Progress = Callable[[float], None]
"""Takes the share of a stage that is done, 0 to 1."""


@dataclass(frozen=True)
class Stage:
    """A step of the pipeline: a row of `tunnel.stage`, and the function that does it.

    Attributes
    ----------
    name : str
    function : str
        ``module:function`` that does one kilometre; connection, survey, km, values of the parameters and progress go in, counts
        come out. Empty for ``load``, which goes by the files (`tunneldb.pipeline.load`).
    reads : tuple of str
        Stages whose results in the kilometre itself it rests on, directly or through another; ``survey`` where it rests on the
        scanner's positions, the reference curve or the kind of intensity, ``sonar`` on what sonar scans saw below the water,
        ``learned`` on what the model of evidence learned from reviews.
    reads_beside : tuple of str
        Stages whose results in the kilometres before and after it rests on.
    parameters : tuple of str
        Prefixes of the parameters that it depends on. Those of ``load`` are kept with the files.
    """

    name: str
    function: str
    reads: tuple[str, ...]
    reads_beside: tuple[str, ...]
    parameters: tuple[str, ...]

    def work(
        self,
        conn: psycopg.Connection[Any],
        survey: Survey,
        km: int,
        values: Mapping[str, float],
        progress: Progress,
    ) -> Counts:
        """Do one kilometre, inside a transaction that the caller holds; what computes is imported only now."""
        module, _, name = self.function.partition(":")
        counts: Counts = getattr(import_module(module), name)(conn, survey, km, values, progress)
        return counts
