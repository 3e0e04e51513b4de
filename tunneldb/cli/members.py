"""The command ``members``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, cast, get_args

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath, file_path
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm
from tunneldb.radiometry.correction import Kind
from tunneldb.store.survey import get_survey

if TYPE_CHECKING:
    from tunneldb.export.exchange.members import Geometry
    from tunneldb.pipeline.members import FileMembers
    from tunneldb.radiometry.reference_curve import ReferenceCurve

_MOST = 20  # rows of a table that are printed


@command(
    examples=[
        "tunneldb members plant.laz --stations stations.csv --intensity Amplitude --intensity-kind amplitude -o out.laz",
        "tunneldb members plant.laz --stations stations.csv --intensity Reflectance --intensity-kind reflectance -o out.gpkg",
        "tunneldb members hall-2024",
    ]
)
@click.argument("survey", metavar="SURVEY|FILE")
@click.option(
    "--stations",
    multiple=True,
    type=FilePath(),
    metavar="FILE",
    help="Scanner positions: CSV with scan_id,x,y,z. E57 and PTX files contain them. May be repeated.",
)
@click.option("--intensity", metavar="DIMENSION", help="Dimension with the intensity.")
@click.option("--intensity-kind", type=click.Choice(get_args(Kind)), help="Kind of intensity, as for tunneldb survey add.")
@click.option(
    "--reference",
    metavar="CSV|auto",
    help="Curve of a reference target for the range correction; auto: estimated from the faces.",
)
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write: .laz or .gpkg; not FILE.")
@click.option(
    "--geometry",
    type=click.Choice(["face", "map", "3d"]),
    help="Coordinates of a .gpkg: plane of each face (pipes unrolled); map; space [3d].",
)
@click.pass_obj
def members(
    settings: Settings,
    survey: str,
    stations: tuple[Path, ...],
    intensity: str | None,
    intensity_kind: str | None,
    reference: str | None,
    output: Path | None,
    geometry: str | None,
) -> None:
    """Find the members of a structure in the files of SURVEY or in a scan FILE, and spots on their surfaces.

    Planes and cylinders are found as faces, and faces separated by shadows are joined into members. Areas dark or
    bright against their own surface are spots: rust, stains, cracks, flakes; an inspector names them. A .laz has the
    input's points with the dimensions face, member and anomaly (0: none), a .gpkg polygons in the layers member, face
    and spot; a FILE needs no database. For a SURVEY, of a site or tunnel, results are stored and replace earlier
    ones: see tunneldb spots and the views tunnel_api.member, face and spot. A spot that is found again keeps its
    number and review.
    """
    from tunneldb.pointcloud.formats.table import scan_suffixes

    if survey.lower().endswith(scan_suffixes()):
        _of_file(file_path(survey), stations, intensity, intensity_kind, reference, output, geometry)
        return
    if stations or output is not None or {intensity, intensity_kind, reference, geometry} != {None}:
        raise UserError(f"options are for a scan file by itself; the survey {survey} has its own: omit them")
    _of_survey(settings, survey)


def _of_survey(settings: Settings, name: str) -> None:
    from tunneldb.pipeline.survey_members import find_survey_members

    with connect(settings.dsn) as conn:
        survey = get_survey(conn, name, site=True)
        conn.rollback()
        with bar("points") as progress:
            done = find_survey_members(conn, survey, step(progress))
    _tell(done.members, None)
    add_to_json(survey=name, new=done.spots.new, again=done.spots.again, kept=done.spots.kept, gone=done.spots.gone)
    _print(done.members)
    if done.spots.again or done.spots.kept or done.spots.gone:
        click.echo(
            f"{done.spots.again} of the spots were known, {done.spots.new} are new; of earlier ones {done.spots.gone} are gone,"
            f" and {done.spots.kept} not found again are kept for their review"
        )


def _of_file(
    file: Path,
    stations: tuple[Path, ...],
    intensity: str | None,
    intensity_kind: str | None,
    reference: str | None,
    output: Path | None,
    geometry: str | None,
) -> None:
    from tunneldb.export.pointcloud.members import check_target, export_members
    from tunneldb.pipeline.members import Inputs, stations_for

    if intensity is None:
        raise UserError(f"{file}: say which dimension holds the intensity: --intensity DIMENSION")
    if intensity_kind is None:
        raise UserError(f"{file}: say what {intensity} is: --intensity-kind {'|'.join(get_args(Kind))}")
    if output is not None:
        check_target(file, output)
    if geometry is not None and (output is None or output.suffix.lower() != ".gpkg"):
        raise UserError("--geometry is of the polygons of a GeoPackage: add -o out.gpkg")
    inputs = Inputs((file,), intensity, cast(Kind, intensity_kind), stations_for(file, list(stations)), _reference(reference))
    with exit_on_sigterm(), bar("points") as progress:
        found = export_members(inputs, output, step(progress), cast("Geometry", geometry or "3d"))
    _tell(found, output)
    _print(found)
    said = "nothing was written: -o out.gpkg or out.laz does" if output is None else f"written to {output}"
    notify(said)


def _reference(given: str | None) -> ReferenceCurve | str | None:
    from tunneldb.csvfile import read_csv
    from tunneldb.pipeline.members import AUTO
    from tunneldb.radiometry.reference_curve import ReferenceCurve

    if given is None or given == AUTO:
        return given
    table = read_csv(file_path(given), ("range_m", "intensity_db"))
    try:
        return ReferenceCurve.from_rows(table["range_m"], table["intensity_db"])
    except UserError as error:
        raise UserError(f"{given}: {error}") from None


def _tell(found: FileMembers, output: Path | None) -> None:
    from tunneldb.export.exchange.members import face_row, member_row, spot_row

    structures = found.found.structures
    add_to_json(
        points=found.points,
        points_far=found.far,
        points_without_position=found.unknown,
        points_without_intensity=found.untold,
        saturated_share=found.saturated,
        voxel=found.segmentation.edge,
        voxels=found.segmentation.voxels,
        noise=found.segmentation.noise,
        members=[member_row(member) for member in structures.members],
        faces=[face_row(face) for face in structures.faces],
        spots=[spot_row(spot) for spot in structures.spots],
        left_out=asdict(structures.left_out),
        notes=found.notes,
        file=output,
    )


def _print(found: FileMembers) -> None:
    structures = found.found.structures
    area = sum(face.area for face in structures.faces)
    seen = sum(face.area * face.seen_share for face in structures.faces)
    click.echo(
        f"{counted(len(structures.members), 'member')} of {counted(len(structures.faces), 'face')},"
        f" {area:.1f} m², {seen:.1f} m² judged;"
        f" {counted(len(structures.spots), 'spot')}"
    )
    rows = [
        [
            str(spot.number), str(spot.member), str(spot.face), spot.kind, f"{1e4 * spot.area:.0f}", f"{spot.difference:.1f}",
            f"{spot.contrast:.1f}", f"{spot.confidence:.2f}", ", ".join(spot.reasons),
        ]
        for spot in sorted(structures.spots, key=lambda spot: -spot.area)[:_MOST]
    ]  # fmt: skip
    if rows:
        header = ["spot", "member", "face", "kind", "cm²", "dB", "σ", "confidence", "shape"]
        print_table(header, rows, right=(0, 1, 2, 4, 5, 6, 7))
    if len(structures.spots) > _MOST:
        click.echo(f"and {len(structures.spots) - _MOST} smaller ones; --json has all")
    left = [
        (found.far, "lie too far from the scanner positions"),
        (found.unknown, "have no scanner position"),
        (found.untold, "have no intensity"),
    ]
    for count, why in left:
        if count:
            click.echo(f"{count} of {found.points} points {why} and were left out")
    if structures.left_out.statement:
        click.echo(structures.left_out.statement)
    if bimodal := [str(member.number) for member in structures.members if member.bimodal]:
        click.echo(f"more than half of member {', '.join(bimodal)} differs (bimodal): its own surface cannot be identified")
    for note in found.notes:
        click.echo(note)
