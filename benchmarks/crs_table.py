"""Table of the projected coordinate systems of EPSG in metres, each written as files state it, and compared with its code.

Forms: WKT 1 of GDAL, with and without axes, and of ESRI; WKT 1 as LAStools writes it, with easting first; WKT 2; the PROJ
string; the GeoTIFF key of the code. A form that is refused for its code would stop a file from being loaded. Each system is
also compared with the next one of the list, of which it must be refused.

    python -m benchmarks.crs_table [--every N] [--out FILE.csv]
"""

from __future__ import annotations

import argparse
import csv
import re
import struct
import warnings
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from pyproj import CRS
from pyproj.database import query_crs_info
from pyproj.enums import PJType
from pyproj.exceptions import CRSError

from tunneldb.geometry.crs_equality import lacks_datum, plan_shift, same_horizontally
from tunneldb.pointcloud.geokeys import DIRECTORY
from tunneldb.pointcloud.stated_crs import WKT, StatedCrs, stated_in_las, stated_in_text

FORMS = ("WKT1 GDAL", "WKT1 GDAL without axes", "WKT1 LAStools", "WKT1 ESRI", "WKT2", "PROJ string", "GeoTIFF key")
_AXIS = re.compile(r',AXIS\["[^"]*",[A-Z]+(?:,AUTHORITY\["[^"]*","[^"]*"\])?\]')


def metric_codes(every: int = 1) -> list[int]:
    """Return the codes of projected systems of EPSG in metres that are not deprecated."""
    infos = query_crs_info("EPSG", [PJType.PROJECTED_CRS])
    codes = sorted(int(info.code) for info in infos)
    return [code for code in codes if _metric(CRS.from_epsg(code))][::every]


def written(crs: CRS, code: int, form: str) -> CRS | None:
    """Return a system as read from its text in a form; None if it cannot be written.

    Raises
    ------
    ValueError
        If the text cannot be read; with the reason.
    """
    if form == "GeoTIFF key":
        keys = struct.pack("<12H", 1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, code)
        return _read(stated_in_las({DIRECTORY: keys}, wkt_counts=False))
    try:
        text = _text(crs, form)
    except CRSError:
        return None
    if not text:
        return None
    if form == "PROJ string":
        return _read(stated_in_text(text, "text"))
    return _read(stated_in_las({WKT: text.encode() + b"\0"}, wkt_counts=True))


def compare(codes: list[int]) -> Iterator[tuple[int, str, str, str]]:
    """Yield code, form, result (equal, refused, unreadable, not writable) and the reason."""
    for code in codes:
        crs = CRS.from_epsg(code)
        for form in FORMS:
            try:
                found = written(crs, code, form)
            except ValueError as error:
                yield code, form, "unreadable", str(error)
                continue
            if found is None:
                yield code, form, "not writable", ""
            elif same_horizontally(found, crs):
                yield code, form, "equal", "datum not stated" if lacks_datum(found) else ""
            else:
                shift = plan_shift(found, crs)
                why = "another datum" if shift < 0.001 else f"coordinates differ by up to {shift:.3g} m"
                yield code, form, "refused", why


def _text(crs: CRS, form: str) -> str | None:
    if form == "PROJ string":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return str(crs.to_proj4()) or None
    version = {"WKT1 ESRI": "WKT1_ESRI", "WKT2": "WKT2_2019"}.get(form, "WKT1_GDAL")
    text = str(crs.to_wkt(version))
    if form in ("WKT1 GDAL without axes", "WKT1 LAStools"):
        text = _AXIS.sub("", text)
    if form == "WKT1 LAStools":
        text = re.sub(r'(,AUTHORITY\["EPSG","\d+"\]\])$', r',AXIS["X",EAST],AXIS["Y",NORTH]\1', text)
    return text


def _read(stated: StatedCrs) -> CRS | None:
    if stated.unread:
        raise ValueError(stated.unread)
    return stated.crs


def _metric(crs: CRS) -> bool:
    return {axis.unit_name for axis in crs.axis_info} == {"metre"}


def main() -> None:
    """Write the table, and print its sums."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--every", type=int, default=1, help="only every n-th system")
    parser.add_argument("--out", type=Path, help="CSV of all that are not equal")
    arguments = parser.parse_args()
    codes = metric_codes(arguments.every)
    rows = list(compare(codes))
    sums = Counter((form, result, why if why == "datum not stated" else "") for _, form, result, why in rows)
    print(f"{len(codes)} systems")
    for form in FORMS:
        print(form, {" ".join(filter(None, key[1:])): count for key, count in sums.items() if key[0] == form})
    same = [pair for pair in pairwise(codes) if same_horizontally(*map(CRS.from_epsg, pair))]
    print(f"{len(codes) - 1} neighbours in the list compared: {len(same)} equal: {same[:20]}")
    if arguments.out:
        with arguments.out.open("w", newline="") as stream:
            table = csv.writer(stream)
            table.writerow(("code", "form", "result", "reason"))
            table.writerows(row for row in rows if row[2] != "equal" or row[3])


if __name__ == "__main__":
    main()
