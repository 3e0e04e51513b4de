"""What stands free in a simulated tunnel, against closed formulas."""

from typing import Any

import numpy as np
import pytest

from tunneldb.simulate import Cloud, Parameters, Simulation, TargetSphere, simulate
from tunneldb.simulate.objects.primitives import BALL, BEAM, ROD

pytestmark = pytest.mark.slow

FEW: dict[str, Any] = {
    "length": 30.0,
    "straight": 3.0,
    "angular_step": 0.4,
    "profile_spacing": 0.03,
    "profile_points": 900,
    "leaks": 1,
    "range_noise": 0.0,
    "outliers": 0.0,
}
ALL: dict[str, Any] = {
    "people": 3,
    "equipment": 3,
    "bollards": 2,
    "globes": 4,
    "spheres": 4,
    "free_cables": 1,
    "catenary": True,
    "sleepers": True,
}
CASES: list[dict[str, Any]] = [
    {"section": "horseshoe", "scanner": "static", "slope": 4.0, "radius": 60.0},
    {"section": "box", "scanner": "profiler", "slope": -4.0, "radius": -100.0},
    {"section": "circular", "scanner": "static", "density": 150.0},
]
LINING, FLOOR, APPENDAGE, OUTLIER, RAIL, OBJECT, SPHERE = 0, 1, 2, 4, 5, 6, 7
# Cosine of the greatest incidence that gives an echo.
GRAZING = 0.087


def sight(simulation: Simulation, cloud: Cloud) -> np.ndarray:
    """Return the scanner position at each point."""
    if simulation.parameters.scanner == "static":
        return simulation.scanner.stations()[cloud.scan_id - 1]
    s = simulation.tunnel.line.start + (cloud.time - 300_000.0) * simulation.parameters.speed
    frame = simulation.tunnel.line.frame(s)
    return frame.position + simulation.parameters.scanner_offset * frame.u + simulation.scanner.height * frame.w


def gap(part: np.ndarray, xyz: np.ndarray) -> np.ndarray:
    """Signed distance of points to a ball, rod or brick, positive outside."""
    d = xyz - part[1:4]
    if part[0] == BALL:
        return np.linalg.norm(d, axis=-1) - part[7]
    if part[0] == ROD:
        along = part[4:7] - part[1:4]
        share = np.clip(d @ along / (along @ along), 0.0, 1.0)
        return np.linalg.norm(d - share[..., None] * along, axis=-1) - part[7]
    q = np.abs(d @ part[8:].reshape(3, 3).T) - part[4:7]
    return np.linalg.norm(np.maximum(q, 0.0), axis=-1) + np.minimum(q.max(axis=-1), 0.0)


def passing(observer: np.ndarray, xyz: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Distance from a place to the segments from ``observer`` to ``xyz``."""
    way = xyz - observer
    share = np.clip(np.sum((centre - observer) * way, axis=1) / np.sum(way * way, axis=1), 0.0, 1.0)
    return np.linalg.norm(observer + share[:, None] * way - centre, axis=1)


@pytest.fixture(scope="module", params=range(len(CASES)))
def scene(request: pytest.FixtureRequest) -> tuple[Simulation, Cloud]:
    p = Parameters(**FEW, **ALL, **CASES[request.param])
    return Simulation(p), simulate(p)


def test_points_lie_on_the_thing_whose_number_they_bear(scene: tuple[Simulation, Cloud]) -> None:
    simulation, cloud = scene
    seen = set()
    for thing in simulation.things:
        on = cloud.thing == thing.number
        assert np.all(cloud.klass[on] == thing.klass)
        if on.any():
            seen.add(thing.kind)
            gaps = np.min([gap(part, cloud.xyz[on]) for part in thing.parts], axis=0)
            assert np.abs(gaps).max() < 1e-6, thing.kind
    assert seen >= {"person", "case", "trolley", "tripod", "bollard", "globe", "sphere", "cable", "catenary"}
    assert np.all(np.isin(cloud.klass[cloud.thing > 0], (APPENDAGE, OBJECT, SPHERE)))
    assert np.all(cloud.thing[np.isin(cloud.klass, (OBJECT, SPHERE))] > 0)
    spheres = {k.id for k in simulation.spheres}
    assert set(np.unique(cloud.thing[cloud.klass == SPHERE])) <= spheres


def test_no_ray_goes_through_a_thing(scene: tuple[Simulation, Cloud]) -> None:
    """March to a sample of points past every ball, rod and brick."""
    simulation, cloud = scene
    observer = sight(simulation, cloud)
    rng = np.random.default_rng(1)
    behind = np.flatnonzero((cloud.range > 2.0) & (cloud.klass != OUTLIER))  # mixed pixels lie behind edges
    sample = np.union1d(rng.choice(behind, 3000), rng.choice(np.flatnonzero(cloud.thing > 0), 500))
    share = np.linspace(0.02, 0.9995, 400)
    for thing in simulation.things:
        middle, radius = thing.extent()
        for part, centre, reach in zip(thing.parts, middle, radius, strict=True):
            near = sample[passing(observer[sample], cloud.xyz[sample], centre) < reach]
            way = observer[near, None] + share[:, None] * (cloud.xyz[near] - observer[near])[:, None]
            assert gap(part, way).min(initial=1.0) > -1e-6, thing.kind


def test_no_point_lies_in_the_shadow_of_a_sphere(scene: tuple[Simulation, Cloud]) -> None:
    simulation, cloud = scene
    observer = sight(simulation, cloud)
    for sphere in simulation.spheres:
        others = cloud.thing != sphere.id
        others[others] &= cloud.klass[others] != OUTLIER  # mixed pixels lie behind its edge
        assert passing(observer[others], cloud.xyz[others], sphere.centre).min() > sphere.radius - 1e-6


def _touching(p: Parameters) -> TargetSphere:
    (sphere,) = (k for k in Simulation(p).spheres if k.kind == "touching")
    return sphere


@pytest.mark.parametrize("scanner", ["static", "profiler"])
def test_exactly_the_rays_towards_a_sphere_meet_it(scanner: Any) -> None:
    """The same rays without and with spheres, told by their times."""
    values: dict[str, Any] = {**FEW, "length": 15.0, "scanner": scanner, "appendages": False, "niches": False}
    p = Parameters(**values, spheres=3, sphere_radius=0.15)
    sphere = _touching(p)
    without, cloud = simulate(Parameters(**values)), simulate(p)
    observer = sight(Simulation(p), without)
    way = without.xyz - observer
    distance = np.linalg.norm(way, axis=1)
    along = np.sum((sphere.centre - observer) * way, axis=1) / distance
    past = np.linalg.norm(sphere.centre - observer - along[:, None] * way / distance[:, None], axis=1)
    aimed = (past < sphere.radius * np.sqrt(1.0 - GRAZING**2)) & (along > 0.0) & (along < distance)
    on = (cloud.thing == sphere.id) | ((cloud.klass == OUTLIER) & np.isin(cloud.time, without.time[aimed]))
    clear = np.isin(cloud.thing, (0, sphere.id))  # tripods of the other spheres may stand before it
    assert aimed.sum() > 40
    blocked = cloud.time[~clear]
    np.testing.assert_array_equal(np.setdiff1d(without.time[aimed], blocked), np.sort(cloud.time[on]))


@pytest.mark.parametrize("scanner", ["static", "profiler"])
def test_spheres_stand_as_their_kinds_say(scanner: Any) -> None:
    p = Parameters(**FEW, scanner=scanner, section="horseshoe", slope=4.0, spheres=8)
    simulation = Simulation(p)
    assert [k.kind for k in simulation.spheres] == [
        "tripod", "bracket", "touching", "hidden", "tripod", "bracket", "tripod", "bracket",
    ]  # fmt: skip
    centres = np.array([k.centre for k in simulation.spheres])
    unrolled = simulation.tunnel.unroll(centres)
    frame = simulation.tunnel.line.frame(unrolled.chainage)
    height = np.sum((centres - frame.position) * frame.w, axis=1) - simulation.tunnel.section.floor
    for k, offset, up in zip(simulation.spheres, unrolled.offset, height, strict=True):
        assert k.radius == 0.0725
        if k.kind == "tripod":
            assert 1.19 < up < 1.71
        elif k.kind == "touching":
            assert offset == pytest.approx(k.radius, abs=1e-6)
        else:
            assert 0.25 < offset < 0.5


def test_about_half_of_the_hidden_sphere_is_seen() -> None:
    p = Parameters(
        **{**FEW, "profile_spacing": 0.02, "profile_points": 1500, "length": 10.0},
        scanner="profiler",
        spheres=4,
        sphere_radius=0.2,
    )
    simulation = Simulation(p)
    cloud = simulate(p)
    hidden = simulation.spheres[3]
    observer = simulation.tunnel.line.frame(simulation.tunnel.unroll(hidden.centre).chainage)
    position = observer.position[0] + p.scanner_offset * observer.u[0] + simulation.scanner.height * observer.w[0]
    distance = np.linalg.norm(position - hidden.centre)
    # Shots per area of a disc across the rays: profiles apart by 1 cm, shots in them by the angle.
    expected = np.pi * hidden.radius**2 / (p.profile_spacing * 2.0 * np.pi / p.profile_points * distance)
    assert (cloud.thing == hidden.id).sum() / expected == pytest.approx(0.5, abs=0.15)


def test_spheres_scatter_by_the_noise_only() -> None:
    p = Parameters(**{**FEW, "range_noise": 0.003}, scanner="static", spheres=5, sphere_radius=0.15)
    cloud = simulate(p)
    gaps = np.concatenate(
        [
            (np.linalg.norm(cloud.xyz[cloud.thing == k.id] - k.centre, axis=1) - k.radius)
            / np.cos(cloud.incidence[cloud.thing == k.id])
            for k in Simulation(p).spheres
        ]
    )
    inner = gaps[np.abs(gaps) < 0.02]  # where the ray grazes, the surface bends away within the noise
    assert inner.size > 400
    assert inner.std() == pytest.approx(0.003, rel=0.25)


def test_mixed_pixels_lie_behind_edges() -> None:
    p = Parameters(**{**FEW, "length": 15.0}, scanner="profiler", free_cables=3, catenary=True, appendages=False, niches=False)
    simulation, cloud = Simulation(p), simulate(p)
    mixed = np.flatnonzero(cloud.klass == OUTLIER)
    assert 20 < mixed.size < 0.1 * (cloud.thing > 0).sum()
    observer = sight(simulation, cloud)[mixed]
    way = observer[:, None] + np.linspace(0.0, 1.0, 4000)[:, None] * (cloud.xyz[mixed] - observer)[:, None]
    nearest = np.full(mixed.size, np.inf)
    for thing in simulation.things:
        for part, centre, reach in zip(thing.parts, *thing.extent(), strict=True):
            near = np.flatnonzero(passing(observer, cloud.xyz[mixed], centre) < reach)
            nearest[near] = np.minimum(nearest[near], gap(part, way[near]).min(axis=1, initial=np.inf))
    assert nearest.max() < 1e-3
    assert nearest.min() > -BEAM - 1e-6


def test_asking_for_more_moves_nothing_else() -> None:
    few = {**FEW, "length": 14.0}
    base = Parameters(**few, scanner="profiler", spheres=4)
    more = Parameters(**few, scanner="profiler", spheres=4, people=3, ballast=0.01)
    one, other = Simulation(base), Simulation(more)
    np.testing.assert_array_equal([k.centre for k in one.spheres], [k.centre for k in other.spheres])
    assert one.leaks == other.leaks
    again = simulate(more)
    np.testing.assert_array_equal(simulate(more).xyz, again.xyz)
    plain, crowded = simulate(Parameters(**few, scanner="profiler")), simulate(base)
    same = np.isin(plain.time, crowded.time[(crowded.thing == 0) & (crowded.klass != OUTLIER)])
    back = np.isin(crowded.time, plain.time[same])
    np.testing.assert_array_equal(plain.xyz[same], crowded.xyz[back])
    assert same.mean() > 0.97


def test_things_stand_on_the_floor_clear_of_each_other_and_of_the_scanner() -> None:
    p = Parameters(
        **{**FEW, "length": 60.0},
        section="horseshoe",
        scanner="profiler",
        people=8,
        equipment=9,
        bollards=6,
        walkway=0.3,
        carriageway=0.2,
    )
    simulation = Simulation(p)
    section = simulation.tunnel.section
    middles = np.array([t.middle() for t in simulation.things])
    unrolled = simulation.tunnel.unroll(middles)
    frame = simulation.tunnel.line.frame(unrolled.chainage)
    across = np.sum((middles - frame.position) * frame.u, axis=1)
    assert np.abs(across - p.scanner_offset).min() > 0.9
    assert np.abs(across).max() < section.half_width
    plan = np.column_stack([unrolled.chainage, across])
    apart = np.linalg.norm(plan[:, None] - plan[None], axis=2) + 9.0 * np.eye(len(plan))
    assert apart.min() > 0.3
    assert len({t.number for t in simulation.things}) == len(simulation.things) == 23
