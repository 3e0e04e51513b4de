"""Commands that refuse options say what to type: each test provokes the message, types that, and succeeds."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyogrio
import pytest
import shapely
from support.axis_files import J_LANDXML
from support.command import command
from support.databases import Copies

TABLES = {
    "axis.csv": "x,y,z\n500000,4640000,100\n500000,4640100,102\n",
    "flat.csv": "x,y,z\n0,0,0\n100,0,0\n200,0,0\n",
    "points.csv": "x,y,z\n500000,4640050,600\n",
    "unrolled.csv": "x,y,z,arc\n500000,4640050,600,1\n",
    "round.csv": "right,up\n-3,-3\n3,-3\n3,3\n-3,3\n-3,-3\n",
    "corner.csv": "right,up\n0,0\n6,0\n6,6\n0,6\n0,0\n",
    "stations.csv": "scan_id,x,y,z\n1,500000,4640050,601\n",
    "stations.of.csv": "chainage,station\n0,511746.75\n",
    "trajectory.csv": "time,x,y,z\n1,500000,4640000,601\n50,500001,4640100,601\n",
    "back.csv": "chainage,station,direction\n-90,1000,-1\n",
    "art.csv": 'art,wkt\ncrack,"LINESTRING(12350 1, 12353 1.5)"\n',
    "place.csv": "kind,chainage,position\nmissing_bolt,12350,1\n",
    "width.csv": "kind,chainage,arc,width\nmissing_bolt,12351,1,\n",
    "point.csv": "kind,chainage,arc\nmissing_bolt,12352,1\n",
    "near.csv": "x,y,z\n100,100,5\n200,150,6\n",
    "unsorted.csv": "time,x,y,z\n50,500001,4640100,601\n1,500000,4640000,601\n",
    "width.xlsx": "",
    "down.csv": "time,x,y,z\n1,500001,4640100,601\n50,500000,4640000,601\n",
}
"""Files in the folder of the commands."""

ADD = "--tunnel demo --date 2024-06-01 --intensity Amplitude --intensity-kind reflectance"
"""Options of a survey."""

CASES = """
leaks demo-2024 --by-km --format csv | --by-km prints a table of all leaks | leaks demo-2024 --by-km
tunnel stationing demo --show --clear | give either a FILE, or (--show), | tunnel stationing demo \\1
report demo-2024 -o r.html --photo-server a/b | such as (photos.example.org:8443)$ | report demo-2024 -o r.html --photo-server \\1
tunnel add z3 --srid 25830 --axis axis.csv near.csv | SCAN files go with --axis auto, or with a line that has none | tunnel add z3 --srid 25830 --axis axis.csv
rings demo-2024 --length 10 --find | by one of (--length), | rings demo-2024 \\1 10
rings demo-2024 --start 12300 | give (--length), too | rings demo-2024 --start 12300 \\1 10
rings demo-2024 --axis axis.csv | --axis is for rings of --points; omit it | rings demo-2024 --length 10
rings | Give a survey, | rings demo-2024 --length 10
leaks demo-2024 --format xlsx | add (-o leaks.xlsx) | leaks demo-2024 --format xlsx \\1
leaks demo-2024 --format gpkg | add (-o leaks.gpkg) | leaks demo-2024 --format gpkg \\1
leaks demo-2024 -o leaks.dxf | written as .*(\\.csv).*: use one of these endings | leaks demo-2024 -o leaks\\1
leaks demo-2024 --clock noon | as (10-2) or | leaks demo-2024 --clock \\1
leaks demo-2024 --clock noon | or (10:30-1:30), | leaks demo-2024 --clock \\1
leaks demo-2024 --clock 10-10 | give two, as (10-2) | leaks demo-2024 --clock \\1
leaks demo-2024 --from 12400 --to 12300 | give the smaller one first | leaks demo-2024 --from 12300 --to 12400
leaks demo-2024 --from 99+000 | (tunnel stationing demo --show) | \\1
leaks demo-2042 | Did you mean '(.*)' | leaks \\1
leaks demo | 'demo' is a tunnel; say which of its surveys: (\\S+)$ | leaks \\1
findings demo-2024 --count --from 12300 | leave out (--from); | findings demo-2024 --count
export demo-2024 -o a.dgn --to 12310 | or (.dxf); | export demo-2024 -o a\\1 --to 12310
export demo-2024 -o b.gpkg --km 12 | chosen by (--from) and (--to) | export demo-2024 -o b.gpkg \\1 12300 \\2 12310
status --watch --json | for one survey: tunneldb status SURVEY | status demo-2024 --json
status demo-2024 --watch --json | leave (--watch) out | status demo-2024 --json
survey set demo-2024 | nothing to set: give (--date), | survey set demo-2024 \\1 2024-05-04
unroll demo-2024 unrolled.csv | already has the column arc: rename or remove it | unroll demo-2024 points.csv
profile add demo corner.csv --layer shotcrete --origin 3 | two numbers, as 0,1.5 | profile add demo corner.csv --layer shotcrete --origin 3,3
profile add demo corner.csv --layer shotcrete --origin 3,3 | (profile remove demo corner --layer shotcrete) | \\1
tunnel add a --srid metric --axis axis.csv | an EPSG number, such as (25830) | tunnel add a --srid \\1 --axis axis.csv
tunnel add b --srid 0 --axis flat.csv | or (local) | tunnel add b --srid \\1 --axis flat.csv
tunnel add c --srid 999999 --axis axis.csv | use an EPSG number, such as (25830) | tunnel add c --srid \\1 --axis axis.csv
tunnel add d --srid 25830 | give a tunnel its (--axis); | tunnel add d --srid 25830 \\1 axis.csv
tunnel add e --srid 25830 | or say (--site), | tunnel add e --srid 25830 \\1
tunnel add f --srid 25830 --site --start-chainage 5 | has no axis: omit --start-chainage | tunnel add f --srid 25830 --site
tunnel add g --srid 25830 --axis axis.csv --axis-out g.csv | --axis-out is for an axis that is found | tunnel add g --srid 25830 --axis axis.csv
tunnel add h --srid 25830 --axis axis.csv --unit ft | --unit and --height-unit are of SCAN files | tunnel add h --srid 25830 --axis axis.csv
tunnel add demo --srid 25830 --axis axis.csv | (tunnel list) | \\1
tunnel add .x --srid 25830 --site | begin with a letter or a digit | tunnel add x --srid 25830 --site
tunnel stationing demo | (--show), or | tunnel stationing demo \\1
tunnel stationing demo | or (--clear) | tunnel stationing demo \\1
leaks demo-2023 | Did you mean '(\\S+)' | leaks \\1
profile add demo second round.csv | remove one of them: tunneldb (profile remove demo) NAME (--layer lining) | \\1 round \\2
tunnel add k --srid 25830 --axis a.xml --reverse | use (--stationing) | tunnel add k --srid 25830 --axis a.xml \\1 back.csv
findings import demo-2024 unplaced.gpkg | it has no geometry; draw it, or delete the row | findings import demo-2024 placed.gpkg
findings import demo-2024 two.gpkg | by (--layer): (\\w+), | findings import demo-2024 two.gpkg \\1 \\2
findings import demo-2024 art.csv | by (--column kind)=THEIRS; .* is '(\\w+), | findings import demo-2024 art.csv \\1=\\2
findings import demo-2024 place.csv | .(--column) OURS=THEIRS.; .*,(\\w+)' | findings import demo-2024 place.csv \\1 arc=\\2
findings import demo-2024 width.csv | add (--column \\S+)$ | findings import demo-2024 width.csv \\1
findings import demo-2024 width.xlsx | save a workbook as (CSV) | findings import demo-2024 point.csv
learn demo-2024 --list --undo | one at a time | learn demo-2024 --list
survey set demo-2024 --stations stations.csv --backwards | give it with (--trajectory) | survey set demo-2024 --backwards \\1 down.csv
survey set demo-2024 --stations stations.csv --time-offset 1 | have no times: omit it | survey set demo-2024 --stations stations.csv
survey add n1 ADD | or (--no-poses) if | survey add n1 ADD \\1
survey add n2 ADD --stations stations.csv --trajectory trajectory.csv | exactly one of --trajectory FILE and (--stations) | survey add n2 ADD \\1 stations.csv
survey add n3 ADD --stations stations.csv --backwards | have no direction: omit it | survey add n3 ADD --stations stations.csv
survey add n4 ADD --stations stations.csv --time-offset 1 | give it with (--trajectory) | survey add n4 ADD --time-offset 1 \\1 trajectory.csv
survey add n5 ADD --no-poses --unit m | give --trajectory or (--stations) | survey add n5 ADD --unit m \\1 stations.csv
survey add n6 ADD --no-poses --intensity-kind amplitude | needs (--intensity-kind reflectance) | survey add n6 ADD --no-poses \\1
survey add n7 ADD --stations stations.csv --reference auto | is not needed | survey add n7 ADD --stations stations.csv
survey add n8 ADD --trajectory unsorted.csv | sort by time | survey add n9 ADD --trajectory trajectory.csv
survey add n1 ADD --no-poses | (survey list) | \\1
survey add n10 ADD --no-poses --tunnel demoo | Did you mean '(\\w+)' | survey add n10 ADD --no-poses --tunnel \\1
survey add n11 ADD --no-poses --tunnel e | is not for a site | survey add n11 ADD --stations stations.csv --tunnel e
survey add n12 ADD --trajectory trajectory.csv --tunnel e | takes the (--stations) | survey add n12 ADD \\1 stations.csv --tunnel e
survey add n13 --tunnel demo --date 2024-06-01 --intensity-kind linear --no-poses | (--intensity) must name | survey add n13 ADD --no-poses \\1 Counts
survey set n1 --accept-poses --date 2024-06-02 | has none; omit it | survey set n1 --date 2024-06-02
survey set n1 --stations stations.csv --trajectory trajectory.csv | omit one of them | survey set n1 --stations stations.csv
survey set n1 --time-offset 1 --date 2024-06-02 | has none; omit it | survey set n1 --date 2024-06-02
profile remove demo none | tunneldb (profile list demo) | \\1
deviation n1 --layer excavation | (profile add demo) profile.csv (--layer excavation) | \\1 round.csv \\2
tunnel add z1 --srid 25830 --site --reverse | omit (--reverse) | tunnel add z1 --srid 25830 --site
qgis demo-2024 | say where the project goes: (-o) | qgis demo-2024 \\1 a.qgz
tunnel remove demo | remove them first .tunneldb (survey remove). | \\1 demo-2024 --yes
"""  # noqa: E501
"""Refused command, advice in its message, and the command that follows it."""


def cases(table: str = CASES) -> list[tuple[str, ...]]:
    return [tuple(line.replace(" ADD", f" {ADD}").split(" | ")) for line in table.strip().splitlines()]


def write_layers(folder: Path) -> None:
    """Write findings without and with a place, and in two layers."""
    point = shapely.to_wkb(shapely.Point(12350, 1))
    for name, layer, place in (("unplaced", "a", None), ("placed", "a", point), ("two", "a", point), ("two", "b", point)):
        path, kind = folder / f"{name}.gpkg", np.array(["missing_bolt"], object)
        pyogrio.raw.write(
            path, np.array([place], object), [kind], ["kind"], geometry_type="Point", layer=layer, append=path.exists()
        )  # fmt: skip


@pytest.fixture(scope="module")
def folder(copies: Copies, example_template: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folder with the files; commands in it work on a copy of the example, which the cases share."""
    folder = tmp_path_factory.mktemp("advice")
    for name, text in TABLES.items():
        (folder / name).write_text(text)
    write_layers(folder)
    shutil.copy(J_LANDXML, folder / "a.xml")
    with copies.connected(example_template), pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yield folder


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
@pytest.mark.parametrize(("refused", "advice", "right"), cases(), ids=lambda text: text[:60])
def test_options(refused: str, advice: str, right: str, folder: Path) -> None:
    message = command(*shlex.split(refused), code=2).stderr
    found = re.search(advice, message)
    assert found, message
    words = shlex.split(found.expand(right))
    command(*words)


NOTES = """
survey add n8 ADD --trajectory down.csv | .(--backwards) confirms that | survey add n14 ADD --trajectory down.csv \\1
vacuum | tunneldb (vacuum --yes)$ | \\1
tunnel add m --srid 25830 --axis axis.csv | (--reverse) turns it round | tunnel add o --srid 25830 --axis axis.csv \\1
tunnel add p --srid 25830 --axis near.csv | use local coordinates .tunnel add (--srid local). | tunnel add q \\1 --axis near.csv
"""
"""Command, advice in its notes, and the command that follows it."""


@pytest.mark.parametrize(("first", "advice", "right"), cases(NOTES), ids=lambda text: text[:60])
def test_notes(first: str, advice: str, right: str, folder: Path) -> None:
    message = command(*shlex.split(first)).stderr
    found = re.search(advice, message)
    assert found, message
    assert command(*shlex.split(found.expand(right))).stderr.partition(":")[2] != message.partition(":")[2]
