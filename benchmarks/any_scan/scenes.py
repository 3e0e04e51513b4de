"""The matrix: what is special about each scan, and what is right for it, written down before it was run."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.any_scan import files
from benchmarks.any_scan.judge import Plan, Scene
from benchmarks.any_scan.scan import LEAKS, LEVEL, Cloud, Leak, join, law, mobile, static
from benchmarks.any_scan.tube import Array, Tube, circular, horseshoe, rectangle

LONG = (Leak(5.5, 1.4, 2.4, 1.2, 5.0), Leak(12.5, -3.0, 1.8, 1.0, 5.0), Leak(18.5, 3.2, 2.6, 0.9, 6.0))
"""Longer than two profiles that lie half a metre apart."""
GALLERY = (Leak(4.0, 0.5, 0.5, 0.4, 5.0), Leak(9.0, -0.8, 0.6, 0.4, 5.0))
TUBE = Tube(circular())
FOOT = 0.3048
Change = Callable[[Cloud], Cloud]


def axis_points(tube: Tube, step: float = 6.0, before: float = 0.0, after: float = 0.0) -> Array:
    count = max(2, round((tube.length + before + after) / step) + 1)
    return tube.axis(np.linspace(-before, tube.length + after, count))


def plan(folder: Path, cloud: Cloud, name: str = "scan.laz", **words: Any) -> Plan:
    """Write the files that a well-prepared user has, and what he types."""
    tube = cloud.tube
    if name.endswith((".las", ".laz")) and not (folder / name).exists():
        files.las(folder / name, cloud)
    files.axis(folder / "axis.csv", axis_points(tube))
    files.reference(folder / "reference.csv")
    if cloud.mobile:
        files.trajectory(folder / "poses.csv", cloud.poses)
    else:
        files.stations(folder / "poses.csv", cloud.poses)
    poses = ["--trajectory" if cloud.mobile else "--stations", "poses.csv"]
    intensity = ["--reference", "reference.csv", "--intensity", "Amplitude", "--intensity-kind", "amplitude"]
    tunnel = words.pop("tunnel", ["--srid", files.SRID, "--axis", "axis.csv"])
    survey = words.pop("poses", poses) + words.pop("intensity", intensity)
    names = words.pop("files", [name])
    return Plan(tube, names, tunnel, survey, words.pop("leaks", cloud.leaks), **words)


def plain(cloud: Callable[[], Cloud], **words: Any) -> Callable[[Path], Plan]:
    return lambda folder: plan(folder, cloud(), **words)


def eyes(cloud: Cloud) -> Array:
    """Return where each point was seen from."""
    if cloud.mobile:
        return np.column_stack([np.interp(cloud.time, cloud.poses[:, 0], cloud.poses[:, k]) for k in (1, 2, 3)])
    return cloud.poses[np.searchsorted(cloud.poses[:, 0], cloud.scan), 1:]


def reflectance(cloud: Cloud) -> Array:
    distance = np.linalg.norm(cloud.xyz - eyes(cloud), axis=1)
    return cloud.db - law(distance) - 6.0


# --- intensity -------------------------------------------------------------------------------------------------------------


def with_intensity(make: Callable[[Cloud], Array], kind: str, name: str = "Amplitude") -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        cloud.extra[name] = make(cloud)
        words = ["--intensity", name, "--intensity-kind", kind]
        return plan(folder, cloud, intensity=words if kind == "reflectance" else ["--reference", "reference.csv", *words])

    return build


def nan_share(share: float) -> Callable[[Cloud], Array]:
    def make(cloud: Cloud) -> Array:
        rng = np.random.default_rng(5)
        return np.where(rng.random(len(cloud)) < share, np.nan, cloud.db)

    return make


def linear_counts(auto: bool) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        out = plan(folder, static(TUBE))
        if auto:
            out.survey = ["--stations", "poses.csv", "--reference", "auto"]
        else:
            counted_reference(folder)
            out.survey = ["--stations", "poses.csv", "--reference", "counted.csv"]
        out.survey += ["--intensity", "intensity", "--intensity-kind", "linear"]
        return out

    return build


def counted_reference(folder: Path, scale: float = 1.0) -> Path:
    """Write the reference of `files.counts`, as dB of counts, times `scale`."""
    distance = np.geomspace(0.5, 40, 40)
    db = law(distance) - LEVEL + 20 + 10 * np.log10(2000 * scale)
    return files.rows(folder / "counted.csv", ["range_m", "intensity_db"], np.column_stack([distance, db]).tolist())


# --- poses -----------------------------------------------------------------------------------------------------------------


def driven(poses: Callable[[Array], Array] = lambda p: p, **words: Any) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        cloud = mobile(TUBE)
        out = plan(folder, cloud, **words)
        files.trajectory(folder / "poses.csv", poses(cloud.poses.copy()))
        return out

    return build


def standing(rows: Callable[[Array], Array]) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        out = plan(folder, cloud)
        files.stations(folder / "poses.csv", rows(cloud.poses.copy()))
        return out

    return build


def ends_early(share: float) -> Callable[[Array], Array]:
    """Cut the trajectory so that `share` of the 24 m driven from 0 s on lie after it."""

    def cut(poses: Array) -> Array:
        start = poses[0, 0] + 1.0
        end = start + 24.0 * (1 - share)
        kept = poses[poses[:, 0] < end]
        last = [np.interp(end, poses[:, 0], poses[:, k]) for k in range(4)]
        return np.vstack([kept, last])

    return cut


def moved(row: int, by: tuple[float, float, float]) -> Callable[[Array], Array]:
    def move(poses: Array) -> Array:
        poses[row, 1:] += by
        return poses

    return move


def zeroed(poses: Array) -> Array:
    poses[25, 1:] = 0.0
    return poses


def swap(poses: Array, *columns: int) -> Array:
    first, second = columns
    poses[:, [first, second]] = poses[:, [second, first]]
    return poses


def mirrored(poses: Array) -> Array:
    poses[:, 0] = poses[::-1, 0]
    return poses[::-1]


def nan_time(folder: Path) -> Plan:
    cloud = mobile(TUBE)
    cloud.time[1234] = np.nan
    return plan(folder, cloud)


# --- axis ------------------------------------------------------------------------------------------------------------------


def axis_file(write: Callable[[Path, Array], Any], name: str, *more: Any, tube: Tube = TUBE) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        out = plan(folder, static(tube, density=400))
        write(folder / name, axis_points(tube))
        out.tunnel = ["--srid", files.SRID, "--axis", name, *more]
        return out

    return build


def axis_changed(change: Callable[[Array], Array], tube: Tube = TUBE, step: float = 6.0) -> Callable[[Path], Plan]:
    return axis_file(lambda path, _: files.axis(path, change(axis_points(tube, step))), "other.csv", tube=tube)


def aside(points: Array) -> Array:
    way = points[-1] - points[0]
    across = np.array([way[1], -way[0], 0.0]) / np.hypot(*way[:2])
    return points + 1.5 * across


def auto_axis(cloud: Callable[[], Cloud]) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        return plan(folder, cloud(), tunnel=["--srid", files.SRID, "--axis", "auto", "scan.laz"])

    return build


# --- formats ---------------------------------------------------------------------------------------------------------------


def in_format(write: Callable[[Path, Cloud], Path], name: str) -> Callable[[Path], Plan]:
    return lambda folder: plan(folder, static(TUBE), name=write(folder / name, static(TUBE)).name)


def with_own_poses(write: Callable[[Path, Cloud], Path], name: str) -> Callable[[Path], Plan]:
    """PTX and E57: stations are the file's, counts are shares of 65535."""

    def build(folder: Path) -> Plan:
        write(folder / name, static(TUBE))
        counted_reference(folder, 1 / 65535)
        words = ["--reference", "counted.csv", "--intensity", "intensity", "--intensity-kind", "linear"]
        return plan(folder, static(TUBE), name=name, poses=["--stations", name], intensity=words)

    return build


def merged(no_poses: bool, name: str = "scan.laz") -> Callable[[Path], Plan]:
    """Make one cloud of all scans, without their numbers, its intensity a reflectance."""

    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        cloud.db = reflectance(cloud)
        cloud.extra["Reflectance"] = cloud.db
        if name.endswith(".pts"):
            files.pts(folder / name, cloud)
        else:
            files.las(folder / name, cloud, scans=False, times=False)
        words = ["--intensity", "intensity" if name.endswith(".pts") else "Reflectance", "--intensity-kind", "reflectance"]
        return plan(folder, cloud, name=name, intensity=words, **({"poses": ["--no-poses"]} if no_poses else {}))

    return build


def written(**options: Any) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        name = "scan.las" if options.get("version") == "1.2" else "scan.laz"
        files.las(folder / name, cloud, **options)
        return plan(folder, cloud, name=name)

    return build


# --- broken files ----------------------------------------------------------------------------------------------------------


def broken(name: str) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        cloud = static(TUBE, density=300)
        path = folder / "scan.laz"
        if name == "one":
            files.las(path, cloud.take(np.array([5000])))
        else:
            files.las(path, cloud)
            data = path.read_bytes()
            path.write_bytes(data[: len(data) * 6 // 10] if name == "clipped" else b"")
        return plan(folder, cloud)

    return build


def in_feet(folder: Path) -> Plan:
    """All coordinates are in feet, and no file says so."""
    cloud = static(TUBE)
    big = replace(cloud, xyz=cloud.xyz / FOOT)
    poses = np.column_stack([cloud.poses[:, 0], cloud.poses[:, 1:] / FOOT])
    files.las(folder / "scan.laz", big, srid=None)
    out = plan(folder, cloud)
    files.stations(folder / "poses.csv", poses)
    files.axis(folder / "axis.csv", axis_points(TUBE) / FOOT)
    out.unit = FOOT
    return out


def in_degrees(folder: Path) -> Plan:
    cloud = static(TUBE, density=200)
    from pyproj import Transformer

    turn = Transformer.from_crs(files.SRID, 4326, always_xy=True)
    lon, lat = turn.transform(cloud.xyz[:, 0], cloud.xyz[:, 1])
    files.las_degrees(folder / "scan.laz", np.column_stack([lon, lat, cloud.xyz[:, 2]]), cloud)
    return plan(folder, cloud)


def at_home(origin: tuple[float, float, float]) -> Callable[[Path], Plan]:
    """Local coordinates without a coordinate system."""

    def build(folder: Path) -> Plan:
        cloud = static(Tube(circular(), origin=origin))
        files.las(folder / "scan.laz", cloud, srid=None)
        return plan(folder, cloud)

    return build


# --- things and surroundings -----------------------------------------------------------------------------------------------


def box(
    tube: Tube, s: tuple[float, float], u: tuple[float, float], w: tuple[float, float], density: float, seed: int = 7
) -> Array:
    """Return points on the six sides of a box."""
    rng = np.random.default_rng(seed)
    sizes = np.array([s[1] - s[0], u[1] - u[0], w[1] - w[0]])
    low = np.array([s[0], u[0], w[0]])
    parts = []
    for fixed in range(3):
        others = [k for k in range(3) if k != fixed]
        n = int(density * sizes[others[0]] * sizes[others[1]])
        for end in (0.0, 1.0):
            part = rng.random((n, 3))
            part[:, fixed] = end
            parts.append(low + part * sizes)
    suw = np.vstack(parts)
    return tube.place(*suw.T)


def train() -> Cloud:
    """A coach 2.6 m wide stands on the right half and hides the wall behind it from below 1.5 m over the axis."""
    cloud = static(TUBE)
    s, u, w = TUBE.unplace(cloud.xyz)
    hidden = (s > 4) & (s < 20) & (u > 0.9) & (w < 1.2)
    cloud = replace(cloud.take(~hidden), leaks=LEAKS)
    coach = box(TUBE, (4, 20), (0.9, 3.0), (-1.9, 1.0), 300)
    return cloud.add(coach, 45.0)


def second_tube(across: float = 15.0) -> Cloud:
    cloud = static(TUBE)
    s, u, w = TUBE.unplace(cloud.xyz)
    other = TUBE.place(s, u + across, w)
    return cloud.add(other, cloud.db)


def open_cuts() -> Cloud:
    """Ten metres of cutting, without a roof, before and behind 24 m of lining; grass scatters more light."""
    rng = np.random.default_rng(9)
    long = replace(TUBE, length=44.0)
    cloud = static(long, leaks=tuple(replace(leak, s=leak.s + 10) for leak in LEAKS))
    s, _, _ = long.unplace(cloud.xyz)
    cloud = cloud.take((s > 10) & (s < 34))
    n = 60000
    s = np.where(rng.random(n) < 0.5, rng.uniform(0, 10, n), rng.uniform(34, 44, n))
    u = rng.uniform(-12, 12, n)
    w = -2.6 + np.maximum(np.abs(u) - 4, 0) * 0.9 + rng.normal(0, 0.12, n)
    return cloud.add(long.place(s, u, w), 46 + rng.normal(0, 2.5, n))


def niches() -> Cloud:
    """Two refuge niches 0.9 m deep on the left, and a cross passage 2.4 m wide and 6 m long on the right."""
    cloud = static(TUBE)
    s, u, w = TUBE.unplace(cloud.xyz)
    niche = ((np.abs(s - 7) < 0.6) | (np.abs(s - 17) < 0.6)) & (u < -2) & (w > -2.6) & (w < -0.5)
    door = (np.abs(s - 12) < 1.2) & (u > 2) & (w > -2.6) & (w < -0.2)
    cloud.xyz[niche] = TUBE.place(s[niche], u[niche] - 0.9, w[niche])
    cloud = replace(cloud.take(~door), leaks=LEAKS)
    passage = box(TUBE, (10.8, 13.2), (3.7, 9.7), (-2.6, -0.2), 300)
    return cloud.add(passage, 45.0)


def in_air(kind: str) -> Cloud:
    rng = np.random.default_rng(11)
    cloud = static(TUBE)
    if kind == "fog":
        n = 8000
        return cloud.add(TUBE.place(rng.uniform(0, 24, n), rng.uniform(-3, 3, n), rng.uniform(-2, 3, n)), 38.0)
    if kind == "person":
        return cloud.add(box(TUBE, (11.8, 12.1), (-0.3, 0.2), (-2.6, -0.85), 2000), 44.0)
    s, _, w = TUBE.unplace(cloud.xyz)
    water = (s > 6) & (s < 18) & (w < -2.55) & (rng.random(len(cloud)) < 0.8)
    return replace(cloud.take(~water), leaks=LEAKS)


# --- several files ---------------------------------------------------------------------------------------------------------


def two_files(overlap: float, seeds: tuple[int, int] = (1, 21)) -> Callable[[Path], Plan]:
    def build(folder: Path) -> Plan:
        cloud = static(TUBE, seed=seeds[0])
        other = static(TUBE, seed=seeds[1])
        s, t = TUBE.unplace(cloud.xyz)[0], TUBE.unplace(other.xyz)[0]
        half = 24 * overlap / 2
        files.las(folder / "a.laz", cloud.take(s < 12 + half))
        files.las(folder / "b.laz", other.take(t > 12 - half))
        return plan(folder, cloud, name="a.laz", files=["a.laz", "b.laz"])

    return build


def twice(folder: Path) -> Plan:
    out = plan(folder, static(TUBE))
    shutil.copy(folder / "scan.laz", folder / "copy.laz")
    out.files = ["scan.laz", "copy.laz"]
    return out


def up_and_down(folder: Path) -> Plan:
    """Two passes, there and back, each with its times, in one trajectory."""
    up, down = mobile(TUBE), mobile(TUBE, seed=12, back=True, start=250100.0)
    files.las(folder / "up.laz", up)
    files.las(folder / "down.laz", down)
    both = replace(up, poses=np.vstack([up.poses, down.poses]))
    return plan(folder, both, name="up.laz", files=["up.laz", "down.laz"])


def across_kilometres(how: str) -> Callable[[Path], Plan]:
    """Chainage 988 to 1012: two kilometres."""

    def build(folder: Path) -> Plan:
        cloud = static(TUBE)
        s = TUBE.unplace(cloud.xyz)[0]
        files.las(folder / "a.laz", cloud.take(s < 12))
        files.las(folder / "b.laz", cloud.take(s >= 12))
        out = plan(folder, cloud, name="a.laz", files=["a.laz", "b.laz"])
        out.tunnel += ["--start-chainage", 988]
        if how == "one":
            out.run = ["--km", "0"]
        elif how == "failed":
            out.between = lambda f: (f / "b.laz").unlink()
        return out

    return build


def bad_batch(folder: Path) -> Plan:
    """Make a batch of three files, one of them truncated."""
    cloud = static(TUBE)
    s = TUBE.unplace(cloud.xyz)[0]
    for number in range(3):
        files.las(folder / f"{number}.laz", cloud.take((s >= 8 * number) & (s < 8 * number + 8)))
    broken = folder / "1.laz"
    broken.write_bytes(broken.read_bytes()[:40000])
    return plan(folder, cloud, name="0.laz", files=["0.laz", "1.laz", "2.laz"])


def one_point_near(folder: Path) -> Plan:
    """The reference curve begins at 1.2 m, and one point of the lining's neighbourhood was seen from 1.08 m."""
    cloud = static(TUBE)
    eye = cloud.poses[0, 1:]
    cloud = join(cloud, cloud.take(np.array([0])))
    cloud.xyz[-1] = eye + np.array([0.0, 0.0, -1.08])
    cloud.scan[-1] = 1
    out = plan(folder, cloud)
    files.reference(folder / "reference.csv", near=1.2)
    return out


def short_reference(folder: Path) -> Plan:
    """The reference curve ends at 4 m: most of the lining lies beyond."""
    out = plan(folder, static(TUBE))
    files.reference(folder / "reference.csv", far=4.0)
    return out


def portal_axis(folder: Path) -> Plan:
    """The axis runs on 6 m into the cuttings on both ends."""
    return plan(folder, open_cuts())


def shifted(by: float) -> Callable[[Array], Array]:
    def shift(poses: Array) -> Array:
        poses[:, 0] += by
        return poses

    return shift


def profiles(spacing: float, leaks: tuple[Leak, ...] = LEAKS, tube: Tube = TUBE) -> Callable[[Path], Plan]:
    return plain(lambda: mobile(tube, spacing, 1200 if spacing < 0.2 else 2500, leaks))


THIN = r"unseen|not seen|was seen|too thin|too few|density|points/m²|per m²"
NOT_DB = r"\bdb\b|counts|linear"
LEFT = r"poses?\b.*left out|left out.*pose"
POSES = r"station|pose|scanner|trajectory|position"

SCENES: tuple[Scene, ...] = (
    # What people have when all is well.
    Scene("plain", "circular, static, 500 points/m²", "result", plain(lambda: static(TUBE))),
    Scene("horseshoe", "horseshoe section", "result", plain(lambda: static(Tube(horseshoe())))),
    Scene("box", "rectangular section", "result", plain(lambda: static(Tube(rectangle())))),
    Scene(
        "gallery",
        "drainage gallery 2.2 m wide",
        "result",
        plain(lambda: static(Tube(circular(1.1, 0.9), length=14), 800, 4, GALLERY)),
    ),
    Scene("wide", "14 m wide", "result", plain(lambda: static(Tube(horseshoe(7.0, 1.5))))),
    Scene("steep", "10 % steep", "result", plain(lambda: static(Tube(circular(), grade=0.1)))),
    Scene(
        "crest",
        "grade from +5 % to -5 % in 24 m",
        "result",
        plain(lambda: static(Tube(circular(), grade=0.05, bend=-0.1 / 24))),
    ),
    Scene("bend", "curve of 80 m radius to the left", "result", plain(lambda: static(Tube(circular(), radius=-80)))),
    Scene("mobile", "profiles 0.02 m apart from a trolley", "result", plain(lambda: mobile(TUBE))),
    Scene("dry", "no leak at all", "result", plain(lambda: static(TUBE, leaks=()))),
    # Intensity that isn't what it was declared.
    Scene(
        "counts-as-db",
        "16-bit counts declared amplitude",
        "warning|refusal",
        with_intensity(lambda c: files.counts(c.db).astype(float), "amplitude"),
        NOT_DB,
        0,
    ),
    Scene(
        "share-as-db",
        "0 to 1 declared amplitude",
        "warning|refusal",
        with_intensity(lambda c: files.counts(c.db) / 65535, "amplitude"),
        NOT_DB,
        0,
    ),
    Scene(
        "db-as-counts",
        "dB declared linear",
        "warning|refusal",
        with_intensity(lambda c: c.db, "linear"),
        r"\bdb\b|decibel|amplitude",
        0,
    ),
    Scene("linear", "16-bit counts declared linear, measured curve", "result", linear_counts(False)),
    # The program refuses where range and incidence can't be told apart, as its pages say; on 24 m that may be right,
    # and a result too much to ask.
    Scene("linear-auto", "16-bit counts declared linear, curve found on the lining", "result", linear_counts(True)),
    Scene(
        "nan-0.1",
        "0.1 % of the intensities are NaN",
        "warning",
        with_intensity(nan_share(0.001), "amplitude"),
        r"nan\b|left out|no number",
    ),
    Scene("nan-50", "half of the intensities are NaN", "refusal", with_intensity(nan_share(0.5), "amplitude"), r"nan|intensit"),
    Scene(
        "saturated",
        "a quarter of the intensities at the upper stop",
        "warning|refusal",
        with_intensity(lambda c: np.minimum(c.db, np.quantile(c.db, 0.75)), "amplitude"),
        r"saturat|clipped|same value|one value|stop|highest|largest|greatest",
    ),
    Scene(
        "constant",
        "every intensity is the same",
        "warning|refusal",
        with_intensity(lambda c: np.full(len(c), 45.0), "amplitude"),
        r"constant|same|one value|alike|nothing but",
        0,
    ),
    Scene(
        "zeros",
        "every intensity is 0",
        "warning|refusal",
        with_intensity(lambda c: np.zeros(len(c)), "amplitude"),
        r"constant|same|one value|zero|\b0\b.*|nothing but",
        0,
    ),
    Scene("near-point", "one point nearer than the reference curve begins", "result", one_point_near),
    Scene(
        "short-curve",
        "reference curve ends at 4 m, half of the lining is farther",
        "warning|refusal",
        short_reference,
        r"reference|curve",
        0,
    ),
    Scene(
        "no-intensity",
        "offset only",
        "warning",
        plain(lambda: static(TUBE), intensity=["--intensity-kind", "none"]),
        r"no leaks? .*sought|not searched|no intensity|without intensity",
        0,
    ),
    # Not looked at.
    Scene(
        "never-detected",
        "stages up to ground only",
        "warning",
        plain(lambda: static(TUBE), run=["--to", "ground"]),
        r"not searched|not been searched",
        0,
    ),
    Scene("one-km", "two kilometres, one was run", "warning", across_kilometres("one"), r"not searched|not been searched", 1),
    Scene(
        "failed-km",
        "two kilometres, the scan file of one is gone before run",
        "warning|refusal",
        across_kilometres("failed"),
        r"failed|not searched|b\.laz",
        1,
    ),
    Scene("two-km", "two kilometres", "result", across_kilometres("")),
    # Density and profiles.
    Scene("d5", "5 points/m²", "warning|refusal", plain(lambda: static(TUBE, 5)), THIN, 0),
    Scene("d20", "20 points/m²", "warning|refusal", plain(lambda: static(TUBE, 20)), THIN, 0, False),
    Scene("d100", "100 points/m²", "result", plain(lambda: static(TUBE, 100)), least=3, pieces=False),
    Scene("d2000", "2000 points/m²", "result", plain(lambda: static(TUBE, 2000))),
    Scene(
        "d20000",
        "20 000 points/m², 4 m of tunnel",
        "result",
        plain(lambda: static(Tube(circular(), length=4.0), 20000, 4, (Leak(2.0, 1.1, 0.9, 1.1, 5.0),))),
    ),
    Scene("profiles-0.05", "profiles 0.05 m apart", "result", profiles(0.05)),
    Scene("profiles-0.1", "profiles 0.1 m apart", "result", profiles(0.1)),
    Scene("profiles-0.25", "profiles 0.25 m apart", "result", profiles(0.25, LONG)),
    Scene("profiles-0.5", "profiles 0.5 m apart", "warning|result", profiles(0.5, LONG), r"profile|spacing|apart"),
    Scene(
        "profiles-1",
        "profiles 1 m apart",
        "warning|refusal",
        profiles(1.0, LONG),
        r"profile|spacing|apart|unseen|was seen|not seen",
        0,
        False,
    ),
    # Axes.
    Scene("axis-short", "axis ends 6 m before the scan", "warning", axis_changed(lambda p: p[:-1]), r"\boutside\b|beyond", 3),
    Scene("axis-reversed", "axis given from the other end", "result", axis_changed(lambda p: p[::-1])),
    Scene("axis-aside", "axis 1.5 m off", "result", axis_changed(aside)),
    Scene(
        "axis-below", "axis on the floor, 2.5 m too low", "result|warning", axis_changed(lambda p: p - np.array([0, 0, 2.5]))
    ),
    Scene("axis-away", "axis 40 m off", "refusal", axis_changed(lambda p: p + np.array([40.0, -28, 0])), r"axis|outside"),
    Scene(
        "axis-chord",
        "two axis points on a curve of 60 m radius, 1.2 m off in the middle",
        "result",
        axis_changed(lambda p: p[[0, -1]], Tube(circular(), radius=60)),
    ),
    Scene(
        "axis-200",
        "200 m between axis points on a curve of 3000 m radius, 1.7 m off",
        "result",
        axis_changed(lambda p: p[[0, -1]], Tube(circular(), length=200.0, radius=3000)),
        pieces=False,
    ),
    Scene("axis-dxf", "axis a polyline of a DXF", "result", axis_file(files.dxf, "axis.dxf")),
    Scene("axis-gpkg", "axis a line of a GeoPackage", "result", axis_file(lambda p, a: files.line(p, a, "GPKG"), "line.gpkg")),
    Scene("axis-shp", "axis a Shapefile", "result", axis_file(lambda p, a: files.line(p, a, "ESRI Shapefile"), "line.shp")),
    Scene("axis-geojson", "axis a GeoJSON", "result", axis_file(lambda p, a: files.line(p, a, "GeoJSON"), "line.geojson")),
    Scene("axis-semicolon", "axis a CSV with semicolons", "result", axis_file(lambda p, a: files.axis(p, a, ";"), "semi.csv")),
    Scene("axis-trajectory", "axis is the trajectory", "result", driven(tunnel=["--srid", files.SRID, "--axis", "poses.csv"])),
    Scene("axis-landxml", "LandXML that states no unit", "refusal", axis_file(files.landxml, "axis.xml"), r"unit"),
    Scene(
        "axis-landxml-m",
        "the same with --axis-unit meter",
        "result",
        axis_file(files.landxml, "axis.xml", "--axis-unit", "meter"),
    ),
    Scene(
        "axis-auto",
        "axis found in the scan, curve of 80 m",
        "result",
        auto_axis(lambda: static(Tube(circular(), radius=-80, length=40))),
    ),
    Scene(
        "axis-auto-gallery",
        "axis found in a gallery of 2.2 m",
        "result",
        auto_axis(lambda: static(Tube(circular(1.1, 0.9), length=20, grade=0.1), 800, 4, GALLERY)),
    ),
    # Formats.
    Scene("ptx", "PTX, poses in the file", "result", with_own_poses(files.ptx, "scan.ptx")),
    Scene("e57", "E57, poses in the file", "result", with_own_poses(files.e57, "scan.e57")),
    Scene("csv", "table with named columns", "result", in_format(files.table, "scan.csv")),
    Scene("xyz", "the same, semicolons, .xyz", "result", in_format(lambda p, c: files.table(p, c, ";"), "scan.xyz")),
    Scene("ply", "binary PLY", "result", in_format(files.ply, "scan.ply")),
    Scene("las-1.2", "LAS 1.2 without coordinate system", "result", written(version="1.2", srid=None), r"coordinate system"),
    Scene("other-crs", "header names another zone", "refusal", written(srid=25833), r"25833|coordinate"),
    Scene("merged", "merged cloud, scan ids all 0, stations given", "refusal", merged(False), r"scan|station"),
    Scene("merged-no-poses", "the same with --no-poses", "warning", merged(True), r"poses|where the scanner|incidence"),
    Scene("pts", "merged PTS with --no-poses", "warning", merged(True, "scan.pts"), r"poses|where the scanner|incidence"),
    # Poses.
    Scene(
        "gap",
        "trajectory lacks 8 s in the middle",
        "warning|refusal",
        driven(lambda p: p[(p[:, 0] < p[0, 0] + 9) | (p[:, 0] > p[0, 0] + 17)]),
        r"gaps?\b|position",
        1,
    ),
    Scene(
        "early-0.6",
        "trajectory ends 0.6 % early",
        "warning",
        driven(ends_early(0.006)),
        r"left out|position is not known",
    ),
    Scene("early-30", "trajectory ends 30 % early", "refusal", driven(ends_early(0.3)), r"trajectory|position|time"),
    # A second is a metre here, which no value contradicts: right is a result that isn't wrong.
    Scene("second", "trajectory 1 s late, 1 m", "result", driven(shifted(1.0))),
    Scene("week", "trajectory a GPS week off", "refusal", driven(shifted(604800.0)), r"time|week"),
    Scene("pose-off", "one pose of the trajectory 30 m off", "warning|refusal", driven(moved(20, (30.0, 0, 0))), LEFT, 3),
    Scene("pose-zero", "one pose at 0, 0, 0", "warning|refusal", driven(zeroed), LEFT, 3),
    Scene("nan-time", "one time is NaN", "warning", nan_time, r"nan\b|left out|no number"),
    Scene("stations-off", "all stations 30 m off", "refusal", standing(lambda p: p + np.array([0, 21.0, -21.0, 0])), POSES),
    Scene("station-off", "one of three stations 30 m off", "warning|refusal", standing(moved(1, (21.0, -21.0, 0))), POSES, 0),
    Scene("station-missing", "one station is missing", "warning|refusal", standing(lambda p: p[[0, 2]]), r"station|scan", 0),
    Scene(
        "station-twice",
        "one station is there twice",
        "refusal",
        standing(lambda p: p[[0, 1, 1, 2]]),
        r"twice|2 times|again|duplicate|once",
    ),
    Scene("station-swapped", "columns x and y are swapped", "refusal", standing(lambda p: swap(p, 1, 2)), POSES),
    # The first and the last station have each other's place: the walls are then 8 m farther away than they can be seen at.
    Scene("mirrored", "numbers of the stations in the other order", "warning|refusal", standing(mirrored), POSES, 0),
    # Surroundings.
    Scene("feet", "feet, no coordinate system", "warning|refusal", in_feet, r"feet|foot|wide|size|metre", 0),
    Scene("second-tube", "a second tube 15 m away in the cloud", "result|warning", plain(second_tube)),
    Scene("train", "a train hides the right wall", "warning|result", plain(train), r"seen|hidden"),
    Scene(
        "open-cuts",
        "open cuts on both ends, axis through them",
        "warning",
        plain(open_cuts),
        r"no roof|without (a )?(roof|lining)|no lining|open|vertex|unseen|not searched",
        3,
    ),
    Scene("niches", "two niches and a cross passage", "result", plain(niches), least=3),
    Scene("fog", "8000 echoes of dust in the air", "result", plain(lambda: in_air("fog"))),
    Scene("person", "a person stands in the middle", "result", plain(lambda: in_air("person"))),
    Scene("water", "water on the floor gives no echo", "result", plain(lambda: in_air("water"))),
    Scene("auto-cuts", "axis found between open cuts", "result|warning", auto_axis(open_cuts), least=3),
    Scene("auto-train", "axis found beside a train", "result|warning", auto_axis(train)),
    Scene("auto-niches", "axis found past niches and a cross passage", "result|warning", auto_axis(niches), least=3),
    # Files.
    Scene("overlap", "two files, half of the tunnel in both", "result", two_files(0.5)),
    Scene("twice", "the same scan in two files", "result|warning", twice, r"same|twice|identical"),
    Scene("up-and-down", "both tracks, driven up and down", "result", up_and_down),
    Scene("clipped", "file cut off at 60 %", "refusal", broken("clipped"), r"scan\.laz"),
    Scene("empty", "file of 0 bytes", "refusal", broken("empty"), r"scan\.laz"),
    Scene("one-point", "file of one point", "refusal", broken("one"), r"scan\.laz|point"),
    Scene("bad-batch", "of three files the middle one is cut off", "refusal", bad_batch, r"1\.laz"),
    Scene("degrees", "geographic coordinates", "refusal", in_degrees, r"degree|geographic|4326"),
    Scene("local", "local coordinates about 0, no coordinate system", "result", at_home((0.0, 0.0, 0.0))),
    Scene("far-north", "coordinates of 8 digits", "result", at_home((32452000.0, 5401000.0, 310.0))),
    # Combinations.
    Scene(
        "bend-steep-auto",
        "curve of 80 m, 10 % steep, axis found",
        "result",
        auto_axis(lambda: static(Tube(horseshoe(), radius=80, grade=0.1, length=36))),
    ),
    Scene("sparse-reversed", "profiles 0.25 m apart, axis reversed", "result", lambda f: _reversed(profiles(0.25, LONG)(f), f)),
    Scene(
        "gallery-sparse", "gallery, profiles 0.1 m apart", "result", profiles(0.1, GALLERY, Tube(circular(1.1, 0.9), length=14))
    ),
    Scene(
        "nan-early",
        "0.1 % NaN intensities, trajectory ends 0.6 % early, a gap of 1 s",
        "warning",
        lambda f: _worn(f),
        r"nan\b|left out",
    ),
)


def _reversed(out: Plan, folder: Path) -> Plan:
    files.axis(folder / "axis.csv", axis_points(out.tube)[::-1])
    return out


def _worn(folder: Path) -> Plan:
    cloud = mobile(TUBE)
    cloud.extra["Amplitude"] = nan_share(0.001)(cloud)
    out = plan(folder, cloud)
    poses = ends_early(0.006)(cloud.poses)
    files.trajectory(folder / "poses.csv", poses[(poses[:, 0] < poses[0, 0] + 9) | (poses[:, 0] > poses[0, 0] + 10)])
    return out
