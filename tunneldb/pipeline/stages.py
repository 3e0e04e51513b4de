"""The stages of a kilometre: their order, what each rests on and what it is done by. The one place that says so.

`tunneldb init` writes STAGES to the table `tunnel.stage`, from which the database's functions and views know them. This module
imports nothing that computes, so that what only shows stages starts at once.
"""

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


STAGES: tuple[Stage, ...] = (
    Stage("load", "", (), (), ()),
    Stage("axis", "tunneldb.pipeline.geometry:axis", ("load",), ("load",), ("axis",)),
    Stage("segments", "tunneldb.pipeline.geometry:segments", ("load", "axis"), ("axis",), ()),
    Stage(
        "sections", "tunneldb.pipeline.geometry:sections", ("load", "axis", "segments", "sonar"), ("segments",), ("section",)
    ),
    Stage(
        "ground",
        "tunneldb.pipeline.ground:ground",
        ("load", "axis", "segments", "sections"),
        ("sections",),
        ("ground", "cluster"),
    ),
    Stage(
        "detect",
        "tunneldb.pipeline.detect:detect",
        ("load", "axis", "segments", "sections", "ground", "survey", "sonar", "learned"),
        ("ground",),
        ("lining", "image", "intensity", "appendage", "leak"),
    ),
)
"""Stages of a kilometre, in their order."""

STAGE_NAMES: tuple[str, ...] = tuple(stage.name for stage in STAGES)
"""Their names, in their order."""
