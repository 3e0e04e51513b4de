import contextlib
import io
from pathlib import Path

import laspy
import lazrs
import numpy as np
import pytest
from laspy.vlrs.known import LasZipVlr, WktCoordinateSystemVlr
from pyproj import CRS
from pyproj.crs import CompoundCRS
from support.real_scans import real_scan

from tunneldb.errors import UserError
from tunneldb.pointcloud.formats.las_bounds import header_box
from tunneldb.pointcloud.formats.raw import read_raw
from tunneldb.pointcloud.formats.table import has_colours
from tunneldb.pointcloud.reader import check_header, crs_note, read_chunks, read_header


def write(
    path: Path,
    count: int = 120_000,
    crs: CRS | None = None,
    point_format: int = 6,
    amplitude: np.ndarray | None = None,
) -> laspy.LasData:
    rng = np.random.default_rng(3)
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales, header.offsets = [0.001] * 3, [500_000, 4_500_000, 100]
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "float32"))
    if crs is not None:
        header.add_crs(crs)
    las = laspy.LasData(header)
    las.x, las.y, las.z = rng.uniform(-50, 50, (3, count)) + np.array([[500_000], [4_500_000], [100]])
    if "gps_time" in las.point_format.dimension_names:
        las.gps_time = np.arange(count) * 0.001
    las.point_source_id = np.arange(count) % 5
    las.classification = np.arange(count) % 3
    las.Amplitude = rng.normal(20, 1, count) if amplitude is None else amplitude
    las.write(path)
    return las


@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_chunks_are_the_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    las = write(path)
    chunks = list(read_chunks(path, "Amplitude", 50_000))
    assert [len(chunk) for chunk in chunks] == [50_000, 50_000, 20_000]
    np.testing.assert_allclose(np.concatenate([chunk.xyz for chunk in chunks]), las.xyz, atol=1e-9)
    for name, dimension in (
        ("time", "gps_time"),
        ("scan_id", "point_source_id"),
        ("intensity", "Amplitude"),
        ("classification", "classification"),
    ):
        found = np.concatenate([getattr(chunk, name) for chunk in chunks])
        np.testing.assert_array_equal(found, np.asarray(las[dimension]))


def write_copc(path: Path, count: int = 10_000) -> laspy.LasData:
    las = write(path.with_suffix(".las"), count)
    las.update_header()
    vlr = lazrs.LazVlr.new_for_compression(6, las.point_format.num_extra_bytes, True)
    las.header.vlrs.append(LasZipVlr(vlr.record_data()))
    las.header.are_points_compressed = True
    with path.open("wb") as file:
        las.header.write_to(file)
        compressor = lazrs.LasZipCompressor(file, vlr)
        for part in np.split(las.points.array, [3000, 3001, 8000]):
            compressor.compress_many(np.frombuffer(part.tobytes(), np.uint8))
            compressor.finish_current_chunk()
        compressor.done()
    return las


def test_chunks_of_varying_size_as_in_copc(tmp_path: Path) -> None:
    las = write_copc(tmp_path / "a.copc.laz")
    chunks = list(read_chunks(tmp_path / "a.copc.laz", None, 2500))
    np.testing.assert_allclose(np.concatenate([chunk.xyz for chunk in chunks]), las.xyz, atol=1e-9)


@pytest.fixture(params=[1, 2], ids=["one thread", "threads"])
def decoding_threads(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr("tunneldb.pointcloud.formats.las.threads", lambda: request.param)
    return request.param


# Across and at the ends of the chunks of `write_copc`, in no order.
RANGES = [(2999, 3002), (7_999, 8_500), (0, 1), (8_000, 10_000), (4_000, 4_000), (9_999, 10_000)]


@pytest.mark.parametrize("suffix", ["las", "laz", "copc.laz"])
@pytest.mark.usefixtures("decoding_threads")
def test_ranges_are_slices_of_the_whole(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    las = write_copc(path) if suffix.startswith("copc") else write(path, 10_000)
    chunks = list(read_chunks(path, "Amplitude", 400, RANGES))
    sizes = [len(chunk) for chunk in chunks]
    assert max(sizes) <= 400
    if not suffix.startswith("copc"):
        assert sizes == [3, 400, 101, 1, 400, 400, 400, 400, 400, 1]
    for name, dimension in (("time", "gps_time"), ("scan_id", "point_source_id"), ("intensity", "Amplitude")):
        whole = np.asarray(las[dimension])
        expected = np.concatenate([whole[begin:end] for begin, end in RANGES])
        np.testing.assert_array_equal(np.concatenate([getattr(chunk, name) for chunk in chunks]), expected)
    expected = np.concatenate([las.xyz[begin:end] for begin, end in RANGES])
    np.testing.assert_allclose(np.concatenate([chunk.xyz for chunk in chunks]), expected, atol=1e-9)


@pytest.mark.usefixtures("decoding_threads")
def test_a_range_of_a_later_chunk_of_the_file(tmp_path: Path) -> None:
    las = write(tmp_path / "a.laz")  # LAZ chunks of 50 000 points
    (chunk,) = read_chunks(tmp_path / "a.laz", None, ranges=[(99_990, 100_010)])
    np.testing.assert_array_equal(chunk.time, las.gps_time[99_990:100_010])


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.usefixtures("decoding_threads")
def test_ranges_of_a_truncated_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    write(path)
    with pytest.raises(UserError, match="its header states 120000 points, points up to 120001 requested"):
        list(read_chunks(path, None, ranges=[(0, 1), (100_000, 120_001)]))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(UserError, match=r"a\.la[sz]: .*(truncated|corrupt)"):
        list(read_chunks(path, "Amplitude", ranges=[(0, 10)]))


@pytest.mark.usefixtures("decoding_threads")
def test_damage_elsewhere_leaves_a_range_alone_and_gives_no_traceback(tmp_path: Path) -> None:
    path = tmp_path / "a.laz"
    write(path)
    data = bytearray(path.read_bytes())
    middle = len(data) // 2  # the second of three chunks
    data[middle : middle + 200_000] = bytes(200_000)
    path.write_bytes(data)
    (good,) = read_chunks(path, "Amplitude", ranges=[(0, 50_000)])
    assert len(good) == 50_000
    with contextlib.suppress(UserError):  # the LAZ format has no checksums: nonsense may decode
        list(read_chunks(path, "Amplitude"))


def test_raw_points_are_the_stored_ones(tmp_path: Path) -> None:
    las = write(tmp_path / "a.laz", 1000)
    (raw,) = read_raw(tmp_path / "a.laz", "Amplitude")
    assert raw.x.dtype == raw.y.dtype == raw.z.dtype == np.int32
    for stored, name in ((raw.x, "X"), (raw.y, "Y"), (raw.z, "Z"), (raw.time, "gps_time"), (raw.intensity, "Amplitude")):
        np.testing.assert_array_equal(stored, np.asarray(las[name]))
    np.testing.assert_array_equal(raw.scales, [0.001] * 3)
    np.testing.assert_array_equal(raw.offsets, [500_000, 4_500_000, 100])
    (bare,) = read_raw(tmp_path / "a.laz", None)
    assert bare.intensity is None


@pytest.mark.parametrize("dimension", [None, "intensity", "Amplitude"])
def test_colours_are_read_where_they_are_asked_for(tmp_path: Path, dimension: str | None) -> None:
    write(tmp_path / "plain.laz", 100)
    assert not has_colours(tmp_path / "plain.laz")
    assert next(read_chunks(tmp_path / "plain.laz", dimension, colours=True)).colour is None
    las = write(tmp_path / "a.laz", 1000, point_format=7)
    las.red, las.green, las.blue = np.random.default_rng(1).integers(0, 65536, (3, 1000))
    las.write(tmp_path / "a.laz")
    assert has_colours(tmp_path / "a.laz")
    assert next(read_chunks(tmp_path / "a.laz", dimension)).colour is None
    chunks = list(read_chunks(tmp_path / "a.laz", dimension, 300, [(0, 500), (700, 1000)], colours=True))
    whole = np.column_stack([las.red, las.green, las.blue])
    np.testing.assert_array_equal(np.vstack([chunk.colour for chunk in chunks]), np.vstack([whole[:500], whole[700:]]))


def test_without_a_dimension_intensity_is_nought(tmp_path: Path) -> None:
    write(tmp_path / "a.laz", 100)
    (chunk,) = read_chunks(tmp_path / "a.laz", None)
    assert not chunk.intensity.any()


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize("share", [0.0, 0.001, 0.004, 0.3, 0.8, 0.999])
def test_truncated(tmp_path: Path, suffix: str, share: float) -> None:
    path = tmp_path / f"a.{suffix}"
    write(path)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(UserError, match=rf"a\.{suffix}: .*(truncated|corrupt)"):
        list(read_chunks(path, "Amplitude", 50_000))


def test_corrupt_header_never_gives_a_traceback(tmp_path: Path) -> None:
    path = tmp_path / "a.laz"
    write(path, 2000)
    data = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(150):
        bad = bytearray(data)
        for place in rng.integers(0, 700, 3):
            bad[place] = int(rng.integers(0, 256))
        path.write_bytes(bad)
        with contextlib.suppress(UserError):
            header = read_header(path)
            if header.points <= 10_000:
                list(read_chunks(path, None, 1000))


def test_missing_and_not_a_scan(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none\.laz: no such file"):
        read_header(tmp_path / "none.laz")
    with pytest.raises(UserError, match="cannot be read: Is a directory"):
        read_header(tmp_path)
    (tmp_path / "a.laz").write_text("x,y,z\n1,2,3\n" * 100)
    with pytest.raises(UserError, match="not a LAS or LAZ file"):
        read_header(tmp_path / "a.laz")


def test_missing_dimension_lists_those_present(tmp_path: Path) -> None:
    write(tmp_path / "a.laz", 10)
    header = read_header(tmp_path / "a.laz")
    with pytest.raises(UserError, match=r"no dimension 'Reflectance'.*gps_time.*Amplitude"):
        check_header(header, "Reflectance", 25830, needs_time=False)
    with pytest.raises(UserError, match="no dimension 'Reflectance'"):
        list(read_chunks(tmp_path / "a.laz", "Reflectance"))


def test_a_trajectory_needs_times(tmp_path: Path) -> None:
    write(tmp_path / "a.las", 10, point_format=0)
    header = read_header(tmp_path / "a.las")
    check_header(header, "Amplitude", 25830, needs_time=False)
    with pytest.raises(UserError, match="no dimension 'gps_time', which the trajectory needs"):
        check_header(header, "Amplitude", 25830, needs_time=True)


@pytest.mark.parametrize(
    "crs",
    [None, CRS(25830), CompoundCRS("both", [CRS(25830), CRS(5782)]), CRS.from_wkt(CRS(25830).to_wkt("WKT1_GDAL"))],
    ids=["none", "same", "compound", "wkt1"],
)
def test_agreeing_coordinate_systems(tmp_path: Path, crs: CRS | None) -> None:
    write(tmp_path / "a.laz", 10, crs)
    check_header(read_header(tmp_path / "a.laz"), "Amplitude", 25830, needs_time=True)


def test_a_coordinate_system_that_nobody_can_read_is_told(tmp_path: Path) -> None:
    las = write(tmp_path / "a.laz", 10)
    las.header.vlrs.append(WktCoordinateSystemVlr("SITE GRID"))
    las.header.global_encoding.wkt = True
    las.write(tmp_path / "b.laz")
    plain, odd = (crs_note(read_header(tmp_path / name), 25830) for name in ("a.laz", "b.laz"))
    assert plain == "states no coordinate system; using the tunnel's, EPSG:25830"
    assert odd is not None
    assert odd.startswith("states a coordinate system that cannot be read (WKT 'SITE GRID'")
    write(tmp_path / "c.laz", 10, CRS(25830))
    assert crs_note(read_header(tmp_path / "c.laz"), 25830) is None


@pytest.mark.parametrize("code", [25829, 32630, 3794])
def test_another_coordinate_system_is_refused_by_name(tmp_path: Path, code: int) -> None:
    write(tmp_path / "a.laz", 10, CRS(code))
    with pytest.raises(UserError, match=rf"EPSG:{code} .*EPSG:25830"):
        check_header(read_header(tmp_path / "a.laz"), "Amplitude", 25830, needs_time=True)


def test_nan_intensity(tmp_path: Path) -> None:
    values = np.ones(100)
    values[[41, 60]] = np.nan
    write(tmp_path / "a.laz", 100, amplitude=values)
    (points,) = read_chunks(tmp_path / "a.laz", "Amplitude")
    assert np.flatnonzero(np.isnan(points.intensity)).tolist() == [41, 60]
    assert np.flatnonzero(~points.finite(time=True, intensity=True)).tolist() == [41, 60]
    assert points.finite(time=True, intensity=False) is None


def test_nan_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "a.las"
    write(path, 10)
    data = bytearray(path.read_bytes())
    data[131:139] = np.array([np.nan]).tobytes()  # the header's x scale
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"scale \(nan, 0\.001, 0\.001\)"):
        read_header(path)


def test_no_points(tmp_path: Path) -> None:
    write(tmp_path / "a.laz", 0)
    with pytest.raises(UserError, match="holds no points"):
        read_header(tmp_path / "a.laz")


NUMBERS = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"]


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize("kind", NUMBERS)
def test_extra_bytes_of_any_number_type_with_scale_and_offset(tmp_path: Path, kind: str, suffix: str) -> None:
    """RIEGL's formats: Amplitude plain or scaled by 0.01, Reflectance signed, beside other dimensions."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_extra_dims([
        laspy.ExtraBytesParams("Deviation", "u2"),
        laspy.ExtraBytesParams("Plain", kind),
        laspy.ExtraBytesParams("Scaled", kind, scales=np.array([0.01]), offsets=np.array([-30.0])),
    ])  # fmt: skip
    las = laspy.LasData(header)
    stored = np.arange(0 if kind[0] == "u" else -100, 101, dtype=kind)
    las.x = las.y = las.z = np.zeros(len(stored))
    for name in ("Plain", "Scaled"):
        las.points.array[name] = stored
    path = tmp_path / f"a.{suffix}"
    las.write(path)
    assert read_header(path).dimensions[-3:] == ("Deviation", "Plain", "Scaled")
    (plain,), (scaled,) = read_chunks(path, "Plain"), read_chunks(path, "Scaled")
    np.testing.assert_array_equal(plain.intensity, stored.astype("f4"))
    np.testing.assert_allclose(scaled.intensity, stored.astype("f8") * 0.01 - 30.0, rtol=1e-6)
    np.testing.assert_allclose(scaled.intensity, np.asarray(laspy.read(path)["Scaled"]), rtol=1e-6)


def test_names_of_dimensions_are_case_exact(tmp_path: Path) -> None:
    write(tmp_path / "a.laz", 10)
    with pytest.raises(
        UserError, match=r"no dimension 'amplitude' \(did you mean 'Amplitude'\? capitals matter\); the file has X, Y"
    ):
        list(read_chunks(tmp_path / "a.laz", "amplitude"))


def test_points_whose_intensity_is_no_data_are_told(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "i2", no_data=[-999], scales=[0.01], offsets=[0.0]))
    las = laspy.LasData(header)
    las.x = las.y = las.z = np.zeros(20)
    stored = np.arange(20)
    las.points.array["Amplitude"] = stored
    las.write(tmp_path / "good.laz")
    (points,) = read_chunks(tmp_path / "good.laz", "Amplitude")
    np.testing.assert_allclose(points.intensity, stored * 0.01, rtol=1e-6)
    las.points.array["Amplitude"][[3, 7]] = -999
    las.write(tmp_path / "bad.laz")
    with pytest.raises(
        UserError, match=r"bad\.laz: 2 points of a chunk without Amplitude, with the header's no-data value -999"
    ):
        list(read_chunks(tmp_path / "bad.laz", "Amplitude"))
    assert sum(map(len, read_chunks(tmp_path / "bad.laz", None))) == 20


def test_several_values_a_point_are_no_intensity(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_extra_dim(laspy.ExtraBytesParams("Normal", "3f4"))
    las = laspy.LasData(header)
    las.x = las.y = las.z = np.zeros(2)
    las.write(tmp_path / "a.laz")
    with pytest.raises(UserError, match="Normal has several values per point"):
        list(read_chunks(tmp_path / "a.laz", "Normal"))


@pytest.mark.parametrize(
    ("name", "dimension"),
    [("extra-bytes", "Deviation"), ("extra-bytes", "intensity"), ("lone-star", "intensity"), ("ringo", None)],
)
def test_real_scans_as_laspy_reads_them(name: str, dimension: str | None) -> None:
    path = real_scan(f"{name}.laz")
    las = laspy.read(path)
    chunks = list(read_chunks(path, dimension, 300_000))
    np.testing.assert_allclose(np.concatenate([chunk.xyz for chunk in chunks]), las.xyz, atol=1e-9)
    for field, theirs in (
        ("time", "gps_time"),
        ("scan_id", "point_source_id"),
        ("classification", "classification"),
        *([("intensity", dimension)] if dimension else []),
    ):
        np.testing.assert_array_equal(np.concatenate([getattr(chunk, field) for chunk in chunks]), np.asarray(las[theirs]))
    (part,) = read_chunks(path, dimension, ranges=[(123_456, 123_987)])
    np.testing.assert_allclose(part.xyz, las.xyz[123_456:123_987], atol=1e-9)


def test_real_extra_bytes_described_in_two_records() -> None:
    """TerraScan describes each dimension in a record of its own; laspy looks at the first and calls the rest ExtraBytes."""
    header = read_header(real_scan("extra-bytes.laz"))
    assert header.dimensions[-2:] == ("Deviation", "confidence")
    found = np.concatenate([chunk.intensity for chunk in read_chunks(real_scan("extra-bytes.laz"), "confidence")])
    np.testing.assert_array_equal(found, np.asarray(laspy.read(real_scan("extra-bytes.laz"))["ExtraBytes"]))


def test_real_scans() -> None:
    assert sum(map(len, read_chunks(real_scan("ringo.laz"), None, 300_000))) == 1_139_889
    header = read_header(real_scan("extra-bytes.laz"))
    check_header(header, "Deviation", 2154, needs_time=True)
    assert sum(map(len, read_chunks(real_scan("extra-bytes.laz"), "Deviation"))) == header.points
    header = read_header(real_scan("lone-star.laz"))
    check_header(header, "intensity", 25830, needs_time=False)
    assert "is geocentric, but x = 5153" in str(crs_note(header, 25830))


@pytest.mark.parametrize(("x", "stated"), [(4_307_000.0, True), (515_396.0, False)])
def test_a_geocentric_system_is_kept_if_the_points_lie_on_the_earth(tmp_path: Path, x: float, stated: bool) -> None:
    """Exporters write a geocentric system over coordinates of a map; 4307 km, 1074 km and 4566 km are in Slovenia."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_crs(CRS.from_epsg(4978))
    las = laspy.LasData(header)
    las.x, las.y, las.z = [x], [1_074_000.0], [4_566_000.0]
    las.write(tmp_path / "a.las")
    assert (read_header(tmp_path / "a.las").crs is not None) == stated


def test_the_box_of_a_file_is_read_even_when_the_rest_is_gone(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [0.001, 0.001, 0.001]
    las = laspy.LasData(header)
    las.x, las.y, las.z = [1.5, 4.25], [20.0, 10.0], [-3.0, 7.5]
    path = tmp_path / "a.laz"
    las.write(path)
    path.write_bytes(path.read_bytes()[:300])
    assert header_box(path) == ((1.5, 10.0, -3.0), (4.25, 20.0, 7.5))
    path.write_bytes(path.read_bytes()[:200])
    assert header_box(path) is None
    path.write_text("no scan " * 100)
    assert header_box(path) is None


@pytest.mark.parametrize("version", [1, 2])
def test_laz_of_early_compressors(tmp_path: Path, version: int) -> None:
    """As LASzip 1.x wrote it: one run of points (compressor 1) without a chunk table, with items of an early version."""
    count = 5000
    header = laspy.LasHeader(point_format=1, version="1.2")
    header.scales, header.offsets = [0.001] * 3, [500_000, 4_500_000, 100]
    las = laspy.LasData(header)
    las.x, las.y, las.z = np.random.default_rng(3).uniform(-50, 50, (3, count)) + np.array([[500_000], [4_500_000], [100]])
    las.intensity = np.arange(count) % 999
    path = tmp_path / "a.laz"
    las.write(path)
    content = bytearray(path.read_bytes())
    points_at = int.from_bytes(content[96:100], "little")
    record_at = content.index(b"laszip encoded") - 2 + 54
    items = int.from_bytes(content[record_at + 32 : record_at + 34], "little")
    for item in range(items):
        content[record_at + 34 + 6 * item + 4] = version
    packed = io.BytesIO()
    compressor = lazrs.LasZipCompressor(packed, lazrs.LazVlr(bytes(content[record_at : record_at + 34 + 6 * items])))
    compressor.compress_many(las.points.array.view(np.uint8))
    compressor.done()
    content[record_at] = 1
    chunk_table_at = int.from_bytes(packed.getvalue()[:8], "little")
    path.write_bytes(content[:points_at] + packed.getvalue()[8:chunk_table_at])

    ranges = [(5, 7), (3000, 4200)]
    chosen = np.r_[5:7, 3000:4200]
    found = list(read_chunks(path, "intensity", 500, ranges))
    np.testing.assert_allclose(np.concatenate([chunk.xyz for chunk in found]), las.xyz[chosen], atol=1e-9)
    np.testing.assert_array_equal(np.concatenate([chunk.intensity for chunk in found]), las.intensity[chosen])
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(UserError, match="truncated"):
        list(read_chunks(path, None))
