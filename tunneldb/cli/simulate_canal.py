"""``tunneldb simulate-canal``: make simulated scans of a canal tunnel, above and below the water."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.progress import say
from tunneldb.cli.simulate_options import NAME, SEED_NUMBER, SRID, parameter_option
from tunneldb.counted import counted
from tunneldb.files import exit_on_sigterm, made_folder
from tunneldb.simulate.canal import CanalParameters, simulate, write

_option = partial(parameter_option, CanalParameters)


@command(
    name="simulate-canal",
    examples=[
        "tunneldb simulate-canal out",
        "tunneldb simulate-canal out --name bend --radius 300 --towpath left --seed 7",
        "tunneldb simulate-canal out --sonar-stations 1 --ladders 1 --sonar-step 0.18",
    ],
)
@click.argument("out", type=FilePath(file_okay=False))
@_option("length", "M", "Length of the canal.")
@_option("radius", "M", "Of the axis: positive curves to the left, 0 is straight.")
@_option("width", "M", "Of the canal at the water.")
@_option("depth", "M", "Of its middle.")
@_option("water_level", "M", "Height of the water.")
@_option("batter", "DEG", "Of the walls above the water, to the vertical.")
@_option("batter_below", "DEG", "The same below it.")
@_option("towpath", "SIDE", "left, right or none.", str)
@_option("piers", "N", "Buttresses before the walls.", int)
@_option("niches", "N", "Recesses in the walls.", int)
@_option("objects", "N", "On the bed.", int)
@click.option("--boat", is_flag=True, help="A boat is moored at a wall.")
@_option("ladders", "N", "In the water, on either bank by turns.", int)
@_option("hidden_rungs", "N", "Of each ladder, which no scan sees.", int)
@_option("laser_stations", "N", "Of the laser.", int)
@_option("laser_spacing", "M", "Between them.")
@_option("laser_step", "DEG", "Between the laser's rays.")
@_option("sonar_stations", "N", "Of the sonar.", int)
@_option("sonar_spacing", "M", "Between them.")
@_option("sonar_step", "DEG", "Between the sonar's fans; a BV5000 has 0.18 or 0.09.")
@_option("sonar_noise", "M", "Standard deviation of a range.")
@click.option("--sonar-z-down", is_flag=True, help="The files' z axis points down.")
@_option("false_share", "SHARE", "Of false echoes.")
@_option(*SRID)
@_option(*NAME)
@_option(*SEED_NUMBER)
def simulate_canal(out: Path, **given: Any) -> None:
    """Simulate scans of a canal tunnel, with their reference data, in the folder OUT.

    A laser scans the tunnel above the water, a mechanical sonar with beams of one degree scans walls and bed below it, from
    tripods whose place and direction are unknown. Both see ladders that stand in the water. Some echoes are false: by way of
    the water's surface, by a second wall, by side lobes.

    \b
    OUT/NAME.laz               the laser's points: LAS 1.4, point_source_id is the station
    OUT/NAME.stations.csv      scan_id,x,y,z
    OUT/NAME.axis.csv          x,y,z
    OUT/NAME.ladders.csv       ladder,rung,height,stile_gap,diameter: as measured on land
    OUT/NAME.sonar-1.xyz, ...  a scan each: x y z intensity, in axes of the sonar's own
    OUT/NAME.truth.json        poses, ladders, the bed

    Lengths are in metres, angles in degrees.
    """  # noqa: D301 - \b is click's mark for lines to be kept
    parameters = CanalParameters(**{name: value for name, value in given.items() if value is not None})
    with exit_on_sigterm(), made_folder(out):  # that it cannot be written is known before minutes are spent
        scene = simulate(parameters, lambda what: say(f"scanned: {what}", err=True))
        files = write(scene, out)
    below = sum(len(scan.points) for scan in scene.sonar)
    add_to_json(points=len(scene.laser), sonar_points=below, files=files)
    click.echo(
        f"{len(scene.laser):,} points above the water, {below:,} below it in {counted(len(scene.sonar), 'scan')}: {files.laser}"
    )
