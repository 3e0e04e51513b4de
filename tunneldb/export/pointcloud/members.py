"""Scan files with the face, the member and the spot of each point added; or these as polygons."""

from __future__ import annotations

from pathlib import Path

from tunneldb.errors import UserError
from tunneldb.export.exchange.members import Geometry, write_members
from tunneldb.export.pointcloud.survey import same_file
from tunneldb.files import replacing
from tunneldb.pipeline.members import AT_ONCE, FileMembers, Inputs, numbers_of_points
from tunneldb.pipeline.spot_colours import find_coloured_members
from tunneldb.pointcloud.reader import read_header
from tunneldb.pointcloud.rewrite import rewrite_with_numbers
from tunneldb.progress import StartProgress

DIMENSIONS = {
    "face": "face, 0: none",
    "member": "member, 0: none",
    "anomaly": "spot, 0: none",
}
"""Attributes added to each point."""


def check_target(source: Path, target: Path) -> None:
    """Refuse a target that cannot be written.

    Raises
    ------
    UserError
    """
    if target.suffix.lower() not in (".laz", ".gpkg"):
        raise UserError(f"{target}: write points as .laz, or polygons as .gpkg; change the extension")
    if same_file(source, target):
        raise UserError(f"{target} is the input file; choose another name with -o")
    if not target.parent.is_dir():
        raise UserError(f"{target.parent}: no such folder")


def export_members(inputs: Inputs, target: Path | None, begin: StartProgress, geometry: Geometry = "3d") -> FileMembers:
    """Find the members of one scan file, and write its points, or polygons of a geometry, if a target is given.

    Raises
    ------
    UserError
        If the file cannot be used, see `find_members` of `pipeline.members`; if the target cannot be written.
    """
    if target is not None:
        check_target(inputs.paths[0], target)
    members = find_coloured_members(inputs, begin)
    if target is None:
        return members
    header = read_header(inputs.paths[0])
    with replacing(target) as temporary:
        if target.suffix.lower() == ".gpkg":
            write_members(temporary, members.found.structures, header.crs, geometry)
        else:
            numbers, progress = numbers_of_points(inputs, members), begin("writing", header.points)
            rewrite_with_numbers(inputs.paths[0], temporary, numbers, DIMENSIONS, progress, AT_ONCE)
    return members
