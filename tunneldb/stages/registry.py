"""The stages of a kilometre: their order, what each rests on and what it is done by. The one place that says so.

`tunneldb init` writes STAGES to the table `tunnel.stage`, from which the database's functions and views know them. This module
imports nothing that computes, so that what only shows stages starts at once.
"""

from __future__ import annotations

from tunneldb.stages.stage import Stage

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
