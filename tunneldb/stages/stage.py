"""Stages: their sources, parameters, results, and functions or commands.

A stage of a kilometre has a function and runs in the order of the registry. A measure is a stage that is run on demand, by a
command of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import psycopg

    from tunneldb.store.survey import Survey

Counts = dict[str, Any]
Progress = Callable[[float], None]
"""Called with the completed share of a stage, 0 to 1."""


class Holds(StrEnum):
    """Content of a parameter of a run."""

    RUN = "run"
    """Keys of the runs that the result was made from: one, or an array."""

    CHECKSUM = "checksum"
    """Checksum of what else it was made from."""

    SURVEY = "survey"
    """Key of the older survey that it is compared with."""


@dataclass(frozen=True)
class Input:
    """Parameter of a stage's runs that names a source of the result: a row of `tunnel.stage_input`.

    Attributes
    ----------
    key : str
        Name of the parameter.
    holds : Holds
    reason : str
        Why the result is out of date when the parameter would be another now; empty for a survey.
    """

    key: str
    holds: Holds
    reason: str = ""


@dataclass(frozen=True)
class Stage:
    """Step of the pipeline or measure: a row of `tunnel.stage`, and its function or command.

    Attributes
    ----------
    name : str
    function : str
        ``module:function`` that processes one kilometre: takes connection, survey, km, values of the parameters and progress,
        returns counts. Empty for ``load``, which works on files (`tunneldb.pipeline.load`), and for measures.
    reads : tuple of str
        Stages whose results in the same kilometre it depends on, directly or indirectly. Also ``survey``: the scanner's
        positions, the reference curve or the kind of intensity; ``sonar``: points of sonar scans below the water;
        ``learned``: the evidence model adapted to reviews. Of a measure only those that it reads directly.
    reads_beside : tuple of str
        Stages whose results in the kilometres before and after it depends on.
    parameters : tuple of str
        Prefixes of the parameters that it depends on. Those of ``load`` are kept with the files.
    tables : tuple of str
        Tables of schema tunnel that hold its results, with the columns ``survey_id`` and ``km``.
    on_demand : bool
        True for a measure.
    subject : tuple of str
        Parameters that distinguish results of the stage in one kilometre; the older survey first, the layer last.
    inputs : tuple of Input
        Inputs whose change makes the results out of date, in the order of comparison.
    command : str
        ``module:command`` of the command line; empty for a stage of a kilometre.
    summary : str
        What the command does, for ``tunneldb --help``.
    """

    name: str
    function: str = ""
    reads: tuple[str, ...] = ()
    reads_beside: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()
    on_demand: bool = False
    subject: tuple[str, ...] = ()
    inputs: tuple[Input, ...] = ()
    command: str = ""
    summary: str = ""

    def work(
        self,
        conn: psycopg.Connection[Any],
        survey: Survey,
        km: int,
        values: Mapping[str, float],
        progress: Progress,
    ) -> Counts:
        """Process one kilometre, in the caller's transaction; the computing package is imported only now."""
        module, _, name = self.function.partition(":")
        counts: Counts = getattr(import_module(module), name)(conn, survey, km, values, progress)
        return counts
