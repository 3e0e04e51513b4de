"""A file in feet is refused, and loaded in metres as its message says; what reads it again gets metres too."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import laspy
import numpy as np
import psycopg
from click.testing import CliRunner
from support.loaded_survey import ORIGIN, SURVEY, add_survey, files, rows, tube

from tunneldb.cli.main import main
from tunneldb.export.pointcloud.survey import survey_files
from tunneldb.geometry.units import METRES
from tunneldb.pointcloud.reader import read_chunks
from tunneldb.queue.batch import plan as plan_batch
from tunneldb.store.remarks import read_remarks
from tunneldb.store.sources import sources
from tunneldb.store.survey import get_survey

FOOT = METRES["us-ft"]
KEYS = {1024: 1, 3072: 25830, 3076: 9003, 4099: 9003}  # the code is of a system in metres


def write_feet(path: Path, xyz: np.ndarray) -> Path:
    header = laspy.LasHeader(point_format=1, version="1.2")
    header.scales, header.offsets = [0.0001] * 3, np.floor(ORIGIN / FOOT)
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "float32"))
    directory = struct.pack("<4H", 1, 1, 0, len(KEYS)) + b"".join(struct.pack("<4H", key, 0, 1, KEYS[key]) for key in KEYS)
    header.vlrs.append(laspy.VLR("LASF_Projection", 34735, record_data=directory))
    las = laspy.LasData(header)
    las.x, las.y, las.z = (xyz / FOOT).T
    las.point_source_id = np.ones(len(xyz), np.uint16)
    las.Amplitude = np.full(len(xyz), 3.0)
    las.write(path)
    return path


def test_the_advice_for_feet_loads_metres(conn: psycopg.Connection, dsn: str, tmp_path: Path) -> None:
    add_survey(conn)
    xyz = tube(975, 990, 60, seed=1)
    path = write_feet(tmp_path / "feet.las", xyz)
    command = ["--dsn", dsn, "load", SURVEY, str(path)]
    refused = CliRunner().invoke(main, command)
    assert refused.exit_code == 2
    assert "in metre, but key 3076 states US survey foot" in refused.stderr
    assert files(conn) == {}
    plan = re.findall(r"--unit (?!m )(\S+?)[;.\n]", refused.stderr)
    height = re.findall(r"--height-unit (\S+)", refused.stderr)
    options = ["--unit", plan[0], "--height-unit", height[0]]
    loaded = CliRunner().invoke(main, [*command, *options])
    assert loaded.exit_code == 0, loaded.output
    kept = np.array([row[3:6] for row in rows(conn)])
    truth = {tuple(np.round(point, 3)) for point in xyz.tolist()}
    assert {tuple(np.round(point, 3)) for point in kept.tolist()} <= truth
    survey = get_survey(conn, SURVEY)
    (remark,) = [remark.said for remark in read_remarks(conn, survey) if "converted" in remark.said]
    assert "x and y converted from US survey foot to metres, as given (GeoTIFF key 3072 states EPSG:25830" in remark
    (source,) = sources(conn, survey, 0)
    again = np.concatenate([chunk.xyz for chunk in read_chunks(path, None, ranges=source.ranges, units=source.units)])
    assert np.abs(again - xyz).max() < 0.0001
    conn.rollback()
    repeated = CliRunner().invoke(main, [*command, *options])
    assert "unchanged" in repeated.output
    conn.rollback()
    assert [file.units.scales.tolist() for file in survey_files(conn, survey)] == [[FOOT] * 3]
    for reading, read_already in (({}, True), ({"load.unit": "us-ft"}, True), ({"load.unit": "ft"}, False)):
        (planned,) = plan_batch(conn, survey, [path], kilometres=range(1), reading=reading).files
        assert planned.already_read == read_already, reading
