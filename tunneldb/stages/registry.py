"""The stages of a kilometre and the measures: order, sources, results and functions. The only place that defines them.

`tunneldb init` writes REGISTRY to the tables `tunnel.stage` and `tunnel.stage_input`. From there the database's functions and
views know the stages: state, queue, pruning, archives, and what is cleared with a kilometre. This module imports nothing that
computes, so that what only shows stages starts at once.
"""

from __future__ import annotations

from tunneldb.stages.stage import Holds, Input, Stage

STAGES: tuple[Stage, ...] = (
    Stage("load"),
    Stage(
        "axis",
        "tunneldb.pipeline.geometry:axis",
        reads=("load",),
        reads_beside=("load",),
        parameters=("axis",),
        tables=("axis_vertex",),
    ),
    Stage(
        "segments",
        "tunneldb.pipeline.geometry:segments",
        reads=("load", "axis"),
        reads_beside=("axis",),
        tables=("segment",),
    ),
    Stage(
        "sections",
        "tunneldb.pipeline.geometry:sections",
        reads=("load", "axis", "segments", "sonar"),
        reads_beside=("segments",),
        parameters=("section",),
        tables=("section",),
    ),
    Stage(
        "ground",
        "tunneldb.pipeline.ground:ground",
        reads=("load", "axis", "segments", "sections"),
        reads_beside=("sections",),
        parameters=("ground", "cluster"),
        tables=("ground", "lining", "cluster", "target_sphere"),
    ),
    Stage(
        "detect",
        "tunneldb.pipeline.detect:detect",
        reads=("load", "axis", "segments", "sections", "ground", "survey", "sonar", "learned"),
        reads_beside=("ground",),
        parameters=("lining", "image", "intensity", "appendage", "detect", "leak"),
        tables=("range_curve", "radiometry", "image", "coverage", "dark_band", "detectability", "finding", "boundary_region"),
    ),
)
"""Stages of a kilometre, in their order."""

MEASURES: tuple[Stage, ...] = (
    Stage(
        "rings",
        reads=("detect",),
        tables=("ring",),
        on_demand=True,
        inputs=(
            Input("detect", Holds.RUN, "detect ran since"),
            Input("rings", Holds.CHECKSUM, "rings changed since"),
        ),
        command="tunneldb.cli.rings:rings",
        summary="Measure lining rings: centre, radius, ovality, steps, chords.",
    ),
    Stage(
        "deviation",
        reads=("detect",),
        tables=("deviation_section",),
        on_demand=True,
        subject=("layer",),
        inputs=(
            Input("detect", Holds.RUN, "detect ran since"),
            Input("profiles", Holds.CHECKSUM, "design profiles changed since"),
        ),
        command="tunneldb.cli.deviation:deviation",
        summary="Measure deviation from design profiles, overbreak and underbreak.",
    ),
    Stage(
        "evenness",
        reads=("deviation",),
        tables=("evenness_section", "evenness_area"),
        on_demand=True,
        subject=("layer",),
        inputs=(Input("deviation", Holds.RUN, "deviation ran since"),),
        command="tunneldb.cli.evenness:evenness",
        summary="Measure evenness with a virtual straightedge.",
    ),
    Stage(
        "thickness",
        reads=("deviation",),
        tables=("thickness_section",),
        on_demand=True,
        subject=("before", "layer"),
        inputs=(
            Input("before", Holds.SURVEY),
            Input("old", Holds.RUN, "deviation of the older survey ran since"),
            Input("new", Holds.RUN, "deviation of the newer survey ran since"),
        ),
        command="tunneldb.cli.thickness:thickness",
        summary="Compute layer thickness and volume between two surveys.",
    ),
    Stage(
        "clearance",
        reads=("ground",),
        tables=("clearance_section", "clearance_infringement"),
        on_demand=True,
        subject=("track", "gauge"),
        inputs=(
            Input("ground", Holds.RUN, "ground ran since"),
            Input("outline", Holds.CHECKSUM, "outline changed since"),
        ),
        command="tunneldb.cli.clearance:clearance",
        summary="Check the clearance around a track.",
    ),
    Stage(
        "compare",
        reads=("detect",),
        tables=("change_section", "change_image", "change_region", "leak_change"),
        on_demand=True,
        subject=("old",),
        inputs=(
            Input("old", Holds.SURVEY),
            Input("detect_old", Holds.RUN, "detect of the older survey ran since"),
            Input("detect_new", Holds.RUN, "detect of the newer survey ran since"),
            Input("leaks_old", Holds.CHECKSUM, "leaks of the older survey changed since"),
            Input("leaks_new", Holds.CHECKSUM, "leaks of the newer survey changed since"),
        ),
        command="tunneldb.cli.compare:compare",
        summary="Compare two surveys: changes of leaks and of the lining.",
    ),
)
"""Measures, each after those that it reads."""

REGISTRY: tuple[Stage, ...] = (*STAGES, *MEASURES)
"""All stages, as they are in `tunnel.stage`."""

STAGE_NAMES: tuple[str, ...] = tuple(stage.name for stage in STAGES)
"""Names of the stages of a kilometre, in their order."""
