"""``tunneldb simulate``: make a simulated scan of a tunnel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import click

from tunneldb.cli.output import Command, add_to_json, command
from tunneldb.cli.param_types import FINITE, FilePath
from tunneldb.cli.progress import bar
from tunneldb.cli.simulate_options import NAME, SEED_NUMBER, SRID, parameter_option
from tunneldb.counted import counted
from tunneldb.simulate import PRESETS, Parameters, Simulation, write
from tunneldb.simulate.parameters import CHOICES


class _Option(NamedTuple):
    """An option that sets a field of Parameters; its default is taken from there."""

    field: str
    metavar: str
    help: str
    type: Any = FINITE
    nargs: int = 1


_GROUPS: dict[str, list[_Option]] = {
    "Tunnel": [
        _Option("length", "M", "Length in plan."),
        _Option("radius", "M", "Radius of the curve: positive bends right, negative left, 0 is straight."),
        _Option("straight", "M", "Straight before the curve [a fifth of the length]."),
        _Option("transition", "M", "Length of the clothoid into the curve, 0 for none."),
        _Option("slope", "%", "Slope, positive is up."),
        _Option("slope_end", "%", "Slope at the end; a parabola over the middle half leads to it [as --slope]."),
        _Option("start_chainage", "M", "Chainage of the start."),
        _Option("azimuth", "DEG", "Direction of the start, from north, clockwise."),
        _Option("origin", "E N Z", "Coordinates of the axis at the start.", FINITE, 3),
        _Option(*SRID),
    ],
    "Section": [
        _Option(
            "section",
            "NAME",
            "circular (flat invert), horseshoe (arch, walls, flat floor) or box (sharp corners).",
            click.Choice(list(CHOICES["section"])),
        ),
        _Option("section_radius", "M", "Radius of circular and of the horseshoe's arch."),
        _Option("invert", "M", "Floor of circular, below the centre of the circle."),
        _Option("wall_height", "M", "Height of the horseshoe's walls."),
        _Option("wall_lean", "DEG", "Lean of the horseshoe's walls, inward towards the floor."),
        _Option("width", "M", "Width of box."),
        _Option("height", "M", "Height of box."),
    ],
    "Scanner": [
        _Option(
            "scanner",
            "NAME",
            "static (tripod on stations) or profiler (on a trolley, one turn of the mirror a profile).",
            click.Choice(list(CHOICES["scanner"])),
        ),
        _Option("station_spacing", "M", "static: largest distance between stations."),
        _Option("angular_step", "DEG", "static: step of azimuth and zenith."),
        _Option("profile_spacing", "M", "profiler: distance that the trolley moves in one turn of the mirror."),
        _Option("profile_points", "N", "profiler: points in one turn.", int),
        _Option("speed", "M/S", "profiler: speed of the trolley."),
        _Option(
            "density",
            "N",
            "Points per m², spread evenly over the surface in place of the scanner's own pattern "
            "(100 is survey density) [the scanner's pattern].",
        ),
        _Option("scanner_height", "M", "Height above the floor."),
        _Option("scanner_offset", "M", "Distance from the middle: trolley to the right, stations alternately right and left."),
        _Option("max_range", "M", "Largest range."),
        _Option("range_noise", "M", "Standard deviation along the ray."),
        _Option("outliers", "SHARE", "Share of isolated points, in the air or behind the wall."),
        _Option("relief", "M", "Height of small-scale relief of the lining."),
        _Option("beam", "MRAD", "Divergence of the beam: echoes at edges mix two surfaces; 0: none."),
        _Option(
            "range_curve",
            "NAME",
            "Decrease of intensity with range: near_loss (with the loss at near ranges) or inverse_square.",
            click.Choice(list(CHOICES["range_curve"])),
        ),
    ],
    "Intensity and contents": [
        _Option("roughness", "DEG", "Oren–Nayar roughness of all surfaces (9 to 20 for concrete)."),
        _Option("intensity_noise", "DB", "Standard deviation of a point's intensity."),
        _Option("banding", "DB", "Standard deviation of the gain from line to line (turns of the mirror, columns)."),
        _Option("drift", "DB", "Standard deviation of the gain over time, in waves of a minute or two."),
        _Option("gain_step", "DB", "Sudden change of the gain, about the middle of the survey."),
        _Option("saturation", "DB", "Largest amplitude of the receiver [none]."),
        _Option(
            "noise_growth",
            "SHARE",
            "Relative increase of noise at 10 m range; four times as much at 20 m.",
        ),
        _Option("ghosts", "SHARE", "Share of the floor's echoes that are reflected to the wall and appear below the ground."),
        _Option("leaks", "N", "Number of leaks [one every 12 m].", int),
        _Option("leak_area", "MIN MAX", "Area of leaks, m².", FINITE, 2),
        _Option("leak_drop", "MIN MAX", "Darkening of leaks, dB.", FINITE, 2),
        _Option("leak_edge", "M", "Width of the transition from dry to wet; the outline of the leak is in the middle of it."),
        _Option("joint_leaks", "N", "Leaks along joints, bands 0.1 to 0.4 m wide; with --lining cast or segments.", int),
        _Option("niche_leaks", "N", "Leaks on the back walls of niches.", int),
        _Option("cable_leaks", "N", "Leaks across cables, pipes and trays.", int),
        _Option("foot_leaks", "N", "Leaks at the foot of the wall, down to the floor.", int),
        _Option("springline_leaks", "N", "Wet joints along the springline, 0.1 to 0.2 m by 5 to 8 m.", int),
        _Option("pocket_leaks", "N", "Weeping bolt pockets, each with a streak; with --lining segments.", int),
        _Option("ring_leaks", "N", "Whole wet rings from foot to foot, across fixtures.", int),
        _Option("panel_leaks", "N", "Wet panels with straight edges: a segment, or a rectangle.", int),
        _Option("drip_gap", "MIN MAX", "Limits of the distance between a leak and its --drips, m.", FINITE, 2),
        _Option("salt_fringe", "M", "Width of the bright salts round each leak."),
    ],
    "Type and surface of the lining": [
        _Option(
            "lining",
            "NAME",
            "plain, cast (blocks), segments (rings of segments with bolt pockets), shotcrete, tiles, brick, stone, "
            "rock (unlined, in rough facets) or rough_shotcrete.",
            click.Choice(list(CHOICES["lining"])),
        ),
        _Option("ring", "M", "Length of the blocks of cast and of the rings of segments [10, 1.5]."),
        _Option("ring_step", "M", "Standard deviation of the radius from ring to ring or block to block."),
        _Option(
            "ring_shift", "M", "Standard deviation of the centre from ring to ring, to the right and up; circular section."
        ),
        _Option("segment_step", "M", "Standard deviation of the offset of segments from their ring."),
        _Option(
            "ovality",
            "MIN MAX",
            "Ovality of rings, largest less smallest diameter, %; the largest is level within 20°; circular section.",
            FINITE,
            2,
        ),
        _Option("radius_step", "M", "Increase of the radius in the second half."),
        _Option("soot", "DB", "Darkening of the crown."),
        _Option("grime", "DB", "Darkening beneath cables and trays."),
        _Option("patches", "N", "Repaired rectangles.", int),
        _Option("patch_level", "MIN MAX", "Brightness of the patches above the lining, dB; negative: darker.", FINITE, 2),
        _Option("patch_turn", "DEG", "Rotation of the patches, to either side."),
        _Option("paint", "N", "Painted numbers and stripes in turn, 4 dB darker to 4 dB brighter.", int),
        _Option("stripe_width", "MIN MAX", "Width of the stripes, m.", FINITE, 2),
        _Option("salts", "%", "Share of the lining that is white with salts."),
        _Option("salt_level", "DB", "Brightness of the salts above the lining."),
        _Option("halos", "N", "Spots of grime in the shape of leaks, with edges that fade over 0.25 m.", int),
        _Option("chamfers", "DB", "Darkening of broken edges of the ring joints, 5 cm wide, inclined by about a degree."),
        _Option("shade", "DB", "Standard deviation of the level from half ring to half ring."),
        _Option(
            "clutter",
            "N",
            "Cables, bundles of cables and pipes in turn, 3 to 30 cm from the wall, along the whole tunnel; also a sign "
            "and a junction box every 10 m.",
            int,
        ),
        _Option("thin_cables", "N", "Bundles of cables and flat ducts on the wall, 3 to 25 mm thick.", int),
        _Option("trunking", "N", "Closed boxes along the whole tunnel, 0.1 to 0.4 m deep.", int),
        _Option("sheets", "N", "Sheets in front of the wall, 1 to 8 m long.", int),
        _Option("mesh", "M", "Distance between the wires of a mesh in front of the lining, 0: none."),
    ],
    "Floor and free-standing objects": [
        _Option("people", "N", "Standing people.", int),
        _Option("equipment", "N", "Cases, trolleys and tripods in turn.", int),
        _Option("bollards", "N", "Round-topped posts.", int),
        _Option("globes", "N", "Round lamps on posts and on the wall in turn, of another radius than the target spheres.", int),
        _Option(
            "spheres",
            "N",
            "Target spheres on tripods and on wall brackets in turn; the third touches the wall, half of the fourth "
            "is hidden behind a cable.",
            int,
        ),
        _Option("sphere_radius", "M", "Radius of the target spheres."),
        _Option("free_cables", "N", "Cables on hangers away from the wall, along the whole tunnel.", int),
        _Option("ballast", "M", "Standard deviation of the floor's height: stones of 3 to 6 cm."),
        _Option("camber", "%", "Fall of the floor from its middle to both walls."),
        _Option(
            "walkway", "M", "Height of a walkway 0.9 m wide along the left wall, and of a kerb 0.4 m wide along the right."
        ),
        _Option("carriageway", "M", "Height of a second carriageway on the right."),
    ],
    "A later scan of the same tunnel": [
        _Option("epoch", "N", "Number of the scan, with noise of its own; 0 is the first.", int),
        _Option("grown_leaks", "N", "Number of leaks, the largest, that have twice the area.", int),
        _Option("dried_leaks", "N", "Number of leaks, the smallest, that are dry.", int),
        _Option("new_leaks", "N", "Number of additional leaks.", int),
        _Option("moved_wall", "M", "Inward movement of a part of the right wall."),
        _Option("squeezed_ring", "M", "Decrease of the width of a ring, equal to the increase of its height."),
        _Option("bulges", "N", "Squares of 1 m² that moved inwards.", int),
        _Option("bulge", "M", "Inward movement of the squares."),
        _Option("pose_error", "M", "Error of the poses across the axis, which varies slowly along the tunnel."),
        _Option("pose_turn", "DEG", "Rotation of the poses about the axis; across it, the largest rotation."),
    ],
    "Other": [
        _Option(*NAME),
        _Option(*SEED_NUMBER),
    ],
}
_FLAGS = {
    "s_curve": ("--s-curve", True, "Curve in the other direction in the second half.", "Tunnel"),
    "appendages": ("--no-appendages", False, "No cables, trays, boxes, lamps and rails.", "Intensity and contents"),
    "niches": ("--no-niches", False, "No refuge niches.", "Intensity and contents"),
    "drips": ("--drips", True, "Drips below leaks, parts of the same reference leak.", "Intensity and contents"),
    "catenary": ("--catenary", True, "A contact line over the track.", "Floor and free-standing objects"),
    "sleepers": ("--sleepers", True, "Sleepers under the rails.", "Floor and free-standing objects"),
}


class _GroupedCommand(Command):
    """A command that lists its options under headings."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, group by group; options without a group come last."""
        headings = {o.field: group for group, options in _GROUPS.items() for o in options}
        headings |= {field: flag[3] for field, flag in _FLAGS.items()}
        for group in _GROUPS:
            rows = []
            for parameter in self.get_params(ctx):
                record = parameter.get_help_record(ctx)
                if isinstance(parameter, click.Option) and record and headings.get(parameter.name or "", "Other") == group:
                    rows.append(record)
            with formatter.section(group):
                formatter.write_dl(rows)


def _options(command: Callable[..., None]) -> Callable[..., None]:
    """Add all options of the groups to a command."""
    for options in reversed(_GROUPS.values()):
        for o in reversed(options):
            command = parameter_option(Parameters, *o)(command)
    for field, (flag, value, text, _) in _FLAGS.items():
        command = click.option(flag, field, flag_value=value, type=bool, default=None, help=text)(command)
    return command


@command(
    cls=_GroupedCommand,
    examples=[
        "tunneldb simulate demo --preset demo",
        "tunneldb simulate out --name bend --section horseshoe --length 100 --radius 300 --slope 4",
        "tunneldb simulate out --section box --scanner profiler --leaks 20 --leak-area 0.1 2 --seed 7",
        "tunneldb simulate out --length 50 --people 4 --equipment 6 --spheres 6 --ballast 0.02 --sleepers --catenary",
        "tunneldb simulate out --length 40 --lining brick --salts 4 --salt-fringe 0.1 --foot-leaks 2 --banding 0.3",
        "tunneldb simulate out --name km --length 25000 --radius 4000 --scanner profiler --density 100 --no-truth",
    ],
)
@click.argument("out", type=FilePath(file_okay=False))
@click.option(
    "--preset",
    type=click.Choice(list(PRESETS)),
    help="Start from named values, which other options override: demo (150 m, 11 million points), "
    "small (40 m, 200 000 points).",
)
@click.option("--no-truth", is_flag=True, help="Leave out the truth of each point (21 bytes a point).")
@_options
def simulate(out: Path, preset: str | None, no_truth: bool, **given: Any) -> None:
    """Simulate a scan of a tunnel, with its reference data, in the folder OUT.

    A section is swept along a curved and sloping axis, perpendicular to it. A static scanner or a profiler on a
    trolley shoots rays at the lining, which carries leaks, cables, a tray, boxes, lamps, rails and refuge niches, and
    at free-standing objects, if options request them. Surfaces behind them get no points. Intensity depends on the
    range (with the loss at near ranges), the incidence (Oren–Nayar), the material and the water, plus noise.

    \b
    OUT/NAME.laz             points: LAS 1.4, Amplitude and Reflectance in dB, intensity in linear counts
                             (NAME-km000.laz and so on when longer than 1 km)
    OUT/NAME.axis.csv        x,y,z every 20 m of the axis
    OUT/NAME.stations.csv    scan_id,x,y,z (static), or
    OUT/NAME.trajectory.csv  time,x,y,z (profiler)
    OUT/NAME.reference.csv   range_m,intensity_db of a 30 % target
    OUT/NAME.truth.npz       chainage, arc, offset, class and leak of each point, in file order;
                             class 0 lining, 1 floor, 2 fixture, 3 niche, 4 outlier, 5 rail, 6 object, 7 target
                             sphere; leak -1 for none; thing: number of a free-standing object, 0 for none
    OUT/NAME.truth.geojson   leaks as polygons in the plane (chainage, arc), with drips as multipolygons
    OUT/NAME.truth.gpkg      the same as layer leak; layer dry: dry dark areas (joint, pocket, patch, paint,
                             stripe, soot, grime, halo, chamfer, shade); layer bright, if any: brighter areas
                             (salts, fringe, patch, paint, stripe, shade), with negative drop; layer deformation,
                             of a later scan: moved areas (wall, ring, bulge), m inwards
    OUT/NAME.rings.csv       number,chainage_from,chainage_to of rings or blocks, if any, their centre from the axis
                             (right, up), radius, ovality (share of the diameter), largest_clock, the greatest
                             step at its beginning (step_greatest) and between segments (lip), positive inwards, with their arc
    OUT/NAME.spheres.csv     id,x,y,z,radius,kind of the target spheres, if any; id is their number among the objects (thing)
    OUT/NAME.json            all parameters, fixtures, niches, objects

    The kind of a leak is wall, joint, niche, cable, foot, springline, pocket, ring or panel.

    Lengths are in metres, angles in degrees, levels in dB.
    """  # noqa: D301 - \b is click's mark for lines to be kept
    values = PRESETS[preset] if preset else {}
    parameters = Parameters(**{**values, **{k: v for k, v in given.items() if v is not None}})
    simulation = Simulation(parameters)
    with bar("points") as progress:
        task = progress.add_task(f"scanning {parameters.name}", total=None)

        def scanned(share: float, points: int) -> None:
            if share > 0.0:
                # how many there will be is guessed from the first ones, once: with another total rich forgets the rate
                total = progress.tasks[0].total or points / share
                progress.update(task, completed=share * total, total=total)

        files = write(simulation, out, truth=not no_truth, progress=scanned)
    area = sum(leak.area for leak in simulation.leaks)
    add_to_json(points=files.points, leaks=len(simulation.leaks), leak_area=area, files=files)
    click.echo(
        f"{files.points:,} points, {counted(len(simulation.leaks), 'leak')} of {area:.2f} m²: "
        + ", ".join(str(p) for p in files.clouds)
    )
