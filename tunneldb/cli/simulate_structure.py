"""``tunneldb simulate-structure``: make a simulated scan of a steel and concrete structure."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FINITE, FilePath
from tunneldb.cli.progress import bar
from tunneldb.cli.simulate_options import NAME, SEED_NUMBER, SRID, parameter_option
from tunneldb.counted import counted
from tunneldb.simulate.structure import StructureParameters, StructureScan, write_structure

_option = partial(parameter_option, StructureParameters)


@command(
    name="simulate-structure",
    examples=[
        "tunneldb simulate-structure out",
        "tunneldb simulate-structure out --name dense --seed 7 --stations 3 --angular-step 0.035",
        "tunneldb simulate-structure out --name clean --anomalies 0",
        "tunneldb simulate-structure out --name night --night",
    ],
)
@click.argument("out", type=FilePath(file_okay=False))
@_option("stations", "N", "Scanner positions, 1 to 4.", int)
@_option("distance", "M", "From the stations to the structure's front.")
@_option("width", "M", "Width of the structure.")
@_option("angular_step", "DEG", "Step of azimuth and zenith.")
@_option("range_noise", "M", "Standard deviation along the ray.")
@_option("beam", "MRAD", "Divergence of the beam: echoes at edges mix two surfaces; 0: none.")
@_option("intensity_noise", "DB", "Standard deviation of a point's intensity.")
@_option("misregistration", "M", "Standard deviation of each station's shift along each axis.")
@_option("gain", "DB", "Standard deviation of each station's level.")
@_option("anomalies", "N", "Rust, stains, cracks and bright flakes; 0 makes a clean scene.", int)
@_option("contrast", "MIN MAX", "By how much they differ, dB.", FINITE, 2)
@_option("fronts", "N", "Objects in front that split what is behind.", int)
@click.option("--night", is_flag=True, help="No colours, and other noise; structure and anomalies stay.")
@_option(*SRID)
@_option(*NAME)
@_option(*SEED_NUMBER)
def simulate_structure(out: Path, **given: Any) -> None:
    """Simulate a scan of a structure, with its reference data, in the folder OUT.

    Profiles, pipes with elbows and flanges, a cable tray, a grating of wires and a bundle of cables are in front of
    a wall of two materials; posts and pipes in front hide strips of them. Painted, bare, galvanised and rusty steel, brick and
    concrete each have a law of reflectance of their own. Some faces carry rust, stains, cracks or bright flakes.

    \b
    OUT/NAME.laz            points: LAS 1.4, point_source_id is the scan, Amplitude and Reflectance in dB, intensity in
                            linear counts, colours by day; true_face, true_member, true_anomaly (0: none; a mixed pixel,
                            a wire and a cable belong to no face), true_incidence in degrees
    OUT/NAME.stations.csv   scan_id,x,y,z
    OUT/NAME.reference.csv  range_m,intensity_db of a 30 % target
    OUT/NAME.truth.json     parameters, members, faces with plane or cylinder, anomalies with outline, area, contrast,
                            incidence and points

    Lengths are in metres, angles in degrees, levels in dB.
    """  # noqa: D301 - \b is click's mark for lines to be kept
    scan = StructureScan(StructureParameters(**{name: value for name, value in given.items() if value is not None}))
    with bar("points") as progress:
        task = progress.add_task(f"scanning {scan.parameters.name}", total=None)
        files = write_structure(scan, out, lambda points: progress.update(task, completed=points))
    counts = {"points": files.points, "faces": len(scan.structure.faces), "anomalies": len(scan.anomalies)}
    add_to_json(**counts, files=files)
    click.echo(
        f"{files.points:,} points, {counted(counts['faces'], 'face')},"
        f" {counted(counts['anomalies'], 'anomaly', 'anomalies')}: {files.cloud}"
    )
