"""Synthetic survey: the tunnel with its contents, and its points block by block."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields, replace

import numpy as np

from tunneldb.arrays import Float, Int32, Int64, Single, UInt8, UInt16
from tunneldb.simulate.epoch import epoch, leaks_since
from tunneldb.simulate.floor_profile import slabs
from tunneldb.simulate.instrument import Instrument, noise_scale
from tunneldb.simulate.lining import ballast as ground
from tunneldb.simulate.lining.blotches import Blotch, place_blotches
from tunneldb.simulate.lining.leak_sites import site_leaks
from tunneldb.simulate.lining.leaks import FreeArea, Leak, place
from tunneldb.simulate.lining.marks import Mark, chamfers, place_marks
from tunneldb.simulate.lining.masonry import Masonry, make_masonry
from tunneldb.simulate.lining.reflectance import Reflectance, lining_reflectance
from tunneldb.simulate.lining.relief import lining_relief
from tunneldb.simulate.lining.ring_shape import RingShape, shape
from tunneldb.simulate.lining.rings import build
from tunneldb.simulate.lining.seepage import joint_leaks, niche_leaks, with_drips
from tunneldb.simulate.objects.fixtures import APPENDAGE, FLOOR, RAIL, Appendage, Niche, furnish, refuges
from tunneldb.simulate.objects.mesh import make_mesh
from tunneldb.simulate.objects.overhead import overhead, sleepers
from tunneldb.simulate.objects.primitives import Primitive, TargetSphere, parts_table
from tunneldb.simulate.objects.wall_clutter import clutter
from tunneldb.simulate.objects.wall_covers import covers
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.placement import place_objects
from tunneldb.simulate.radiometry import counts, reference_curve
from tunneldb.simulate.rays.beam import blur
from tunneldb.simulate.rays.ghosts import mirror
from tunneldb.simulate.rays.scene import scene
from tunneldb.simulate.rays.trace import Echoes, Tracer
from tunneldb.simulate.scanner import BlockPlan, Scanner
from tunneldb.simulate.tunnel.tunnel import Tunnel


@dataclass(frozen=True)
class Cloud:
    """Points with reference data, all arrays of n in file order.

    Attributes
    ----------
    xyz : (n, 3)
        Coordinates, m.
    time : (n,)
        GPS time, s.
    scan_id : (n,)
        Station number from 1; 1 for a profiler.
    amplitude, reflectance : (n,)
        dB.
    intensity : (n,)
        Linear counts.
    chainage, arc, offset : (n,)
        Coordinates of the stored point, m.
    klass : (n,)
        0 lining, 1 floor, 2 appendage, 3 niche, 4 outlier, 5 rail, 6 object, 7 target sphere.
    leak : (n,)
        Id of the leak at the point, -1 for none.
    thing : (n,)
        Number of the free-standing object at the point, for a target sphere that of the sphere; 0 for none.
    range, incidence : (n,)
        Distance from the scanner to the surface point, m, and angle to its normal, rad; without noise.
    """

    xyz: Float
    time: Float
    scan_id: UInt16
    amplitude: Single
    reflectance: Single
    intensity: UInt16
    chainage: Float
    arc: Single
    offset: Single
    klass: UInt8
    leak: Int32
    thing: UInt16
    range: Single
    incidence: Single

    def __len__(self) -> int:
        return len(self.time)


class Simulation:
    """Synthetic survey, ready to be scanned.

    Attributes
    ----------
    parameters : Parameters
    tunnel : Tunnel
        Exact geometry.
    appendages, niches, leaks, marks, blotches : list
        Contents of the tunnel.
    rings : Rings
        Rings or blocks of the lining.
    ring_steps : (n,) float array
        Inward displacement of each ring of the lining, m.
    ring_shape : RingShape
        Other deviations of each ring from the section.
    masonry : Masonry
        Bricks or stones of the lining.
    reflectance : Reflectance or None
        Variation of the lining's reflectance; None: uniform.
    things : list of Primitive
        Free-standing and hanging objects; object i has number i + 1.
    spheres : list of TargetSphere
        Target spheres; sphere i is object i.
    scanner : Scanner
        Poses of the scanner.
    instrument : Instrument
        Errors of the instrument in the intensity.
    epoch : Epoch or None
        Changes of the lining before a later scan; its offsets include them, its chainages and arcs are those of the first scan.
    """

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.tunnel: Tunnel = parameters.tunnel()
        # Later streams are appended, so that a seed keeps its points.
        streams = np.random.SeedSequence(parameters.seed).spawn(22)
        furniture, wet, reference, self._seed, free, loose, built = streams[:7]
        marked, coated, joints, refuge, drips, moved, hung = streams[7:14]
        covered, coursed, sited, blotched, chamfered, meshed, electric, shaped = streams[14:]
        self.appendages: list[Appendage] = (
            furnish(self.tunnel, np.random.default_rng(furniture)) if parameters.appendages else []
        )
        self.niches: list[Niche] = refuges(self.tunnel) if parameters.niches else []
        self.appendages += clutter(parameters, self.tunnel, self.appendages, hung)
        self.appendages += covers(parameters, self.tunnel, self.appendages, covered)
        self.appendages += slabs(parameters, self.tunnel)
        openings = [n.footprint(self.tunnel) for n in self.niches]
        along = [a for a in self.appendages if a.is_run or a.klass != APPENDAGE]
        fixed = [a.footprint() for a in self.appendages if a not in along]
        self.rings = build(parameters, self.tunnel, built, chamfered)
        self.ring_shape: RingShape = shape(parameters, self.rings, shaped)
        self.masonry: Masonry = make_masonry(parameters, coursed)
        free_area = FreeArea(self.tunnel, fixed + openings, [a.footprint() for a in along])
        self.leaks: list[Leak] = self._leaks(free_area, wet, joints, refuge, drips, sited)
        self.marks: list[Mark] = place_marks(parameters, self.tunnel, [k.polygon for k in self.leaks] + openings, marked)
        self.marks += chamfers(parameters, self.tunnel, self.rings)
        taken = openings + [m.polygon() for m in self.marks if m.kind != "chamfer"]
        self.blotches: list[Blotch] = place_blotches(parameters, self.tunnel, self.rings, self.leaks, taken, blotched)
        self.reflectance: Reflectance | None = lining_reflectance(
            parameters, self.tunnel, self.rings, self.masonry, self.appendages, self.marks, self.blotches, coated
        )
        self._relief = lining_relief(parameters, self.tunnel, self.rings, self.ring_shape, self.masonry, moved)
        self.ring_steps = np.zeros(self.rings.level.size) if self._relief is None else self._relief.step
        self._mesh = make_mesh(parameters, self._relief.high if self._relief is not None else 0.0, meshed)
        self._radiometry = parameters.radiometry()
        self.reference = reference_curve(parameters.max_range, np.random.default_rng(reference), self._radiometry.near_loss)
        self.scanner = Scanner(parameters, self.tunnel)
        self.instrument = Instrument.of(parameters, *self.scanner.times(), electric)
        standing, spheres = place_objects(parameters, self.tunnel, self.scanner, self.appendages, self.niches, free)
        self.spheres: list[TargetSphere] = spheres
        self.things: list[Primitive] = standing + overhead(parameters, self.tunnel, loose, len(standing) + 1)
        self.epoch = epoch(parameters, self.tunnel)
        if self.epoch is not None:
            self.leaks = leaks_since(parameters, self.tunnel, free_area, self.leaks)
            self._seed = np.random.SeedSequence(self._seed.entropy, spawn_key=(*self._seed.spawn_key, parameters.epoch, 1))
        self._scene = scene(
            self.tunnel,
            self.appendages,
            self.niches,
            self.leaks,
            parameters.leak_edge,
        )
        solid = self.things + sleepers(parameters, self.tunnel)
        self._parts = parts_table(self.tunnel, solid) if solid else None
        self._ground = ground.make_ground(parameters, self.tunnel.section, int(free.generate_state(1)[0]))

    def _leaks(
        self,
        free_area: FreeArea,
        wall: np.random.SeedSequence,
        joints: np.random.SeedSequence,
        refuge: np.random.SeedSequence,
        drips: np.random.SeedSequence,
        sited: np.random.SeedSequence,
    ) -> list[Leak]:
        """Return leaks on the wall, along joints, in niches, and at particular places, numbered in this order.

        The last are placed first, since some need a whole ring.
        """
        p, tunnel = self.parameters, self.tunnel
        at_sites = site_leaks(p, tunnel, self.rings, self.appendages, free_area, sited)
        leaks = place(tunnel, free_area, p.leak_count(), p.leak_area, p.leak_drop, np.random.default_rng(wall))
        leaks += joint_leaks(p, tunnel, self.rings, free_area, joints)
        leaks += niche_leaks(p, tunnel, self.niches, refuge) + at_sites
        leaks = [replace(leak, id=i + 1) for i, leak in enumerate(leaks)]
        return with_drips(leaks, p.drip_gap, free_area, drips) if p.drips else leaks

    def make(self, plan: BlockPlan) -> Cloud:
        """Return the points of one block, reproducible by seed and index."""
        p = self.parameters
        sequence = np.random.SeedSequence(self._seed.entropy, spawn_key=(*self._seed.spawn_key, plan.index))
        rng = np.random.default_rng(sequence)
        rays = self.scanner.rays(plan, rng)
        n = len(rays.time)
        tracer = self._tracer()
        found = tracer.trace(rays.origin, rays.direction, rays.hint, rng.standard_normal(n) * p.range_noise, rng.random((n, 2)))
        radiometry = self._radiometry
        noise = rng.standard_normal(len(found.ray)) * p.intensity_noise
        if p.beam > 0.0:

            def again(index: Int64, direction: Float) -> Echoes:
                """Trace without noise, and with numbers that make no stray points."""
                many = len(index)
                return tracer.trace(rays.origin[index], direction, rays.hint[index], np.zeros(many), np.ones((many, 2)))

            found = blur(found, rays, p.beam, again, self.tunnel, radiometry, rng)
        if p.ghosts > 0.0:

            def by_floor(origin: Float, direction: Float, hint: Float) -> Echoes:
                """Trace without noise and stray points."""
                return tracer.trace(origin, direction, hint, np.zeros(len(hint)), np.ones((len(hint), 2)))

            found = mirror(found, rays, p.ghosts, p.max_range, by_floor, self.tunnel, rng)
        is_ground = (found.klass == FLOOR) | (found.klass == RAIL)
        noise *= noise_scale(p.noise_growth, found.range)
        reflectance = radiometry.reflectance(found.cosine, is_ground, found.drop) + noise
        reflectance += self.instrument.gain(rays.time[found.ray], rays.line[found.ray])
        full = radiometry.amplitude(found.range, reflectance)
        amplitude = self.instrument.capped(full)
        reflectance -= full - amplitude
        xyz, offset = found.xyz, found.offset
        if self.epoch is not None:
            xyz, offset = self.epoch.moved(xyz, found.chainage, found.arc, offset)
        return Cloud(
            xyz=xyz + self.tunnel.line.origin,
            time=rays.time[found.ray],
            scan_id=rays.scan_id[found.ray],
            amplitude=amplitude.astype(np.float32),
            reflectance=reflectance.astype(np.float32),
            intensity=counts(amplitude, radiometry.near_loss),
            chainage=found.chainage,
            arc=found.arc.astype(np.float32),
            offset=offset.astype(np.float32),
            klass=found.klass.astype(np.uint8),
            leak=np.where(found.leak >= 0, found.leak + 1, -1).astype(np.int32),
            thing=found.thing.astype(np.uint16),
            range=found.range.astype(np.float32),
            incidence=np.arccos(found.cosine).astype(np.float32),
        )

    def _tracer(self) -> Tracer:
        p = self.parameters
        return Tracer(
            self.tunnel,
            self._scene,
            self._parts,
            self._ground,
            self.reflectance,
            self._relief,
            p.outliers,
            1.0 if p.beam == 0.0 else 0.0,
            p.relief,
            p.max_range,
            self._mesh,
            p.noise_growth,
        )

    def blocks(self, workers: int | None = None) -> Iterator[tuple[BlockPlan, Cloud]]:
        """Yield blocks in file order, made a few ahead by threads (the kernels release the interpreter's lock)."""
        count = workers or os.cpu_count() or 1
        waiting: deque[tuple[BlockPlan, Future[Cloud]]] = deque()
        with ThreadPoolExecutor(count) as pool:
            for plan in self.scanner.plans():
                waiting.append((plan, pool.submit(self.make, plan)))
                if len(waiting) > count + 1:
                    done, future = waiting.popleft()
                    yield done, future.result()
            while waiting:
                done, future = waiting.popleft()
                yield done, future.result()


def simulate(parameters: Parameters) -> Cloud:
    """Return all points of a synthetic survey at once, for small ones."""
    clouds = [cloud for _, cloud in Simulation(parameters).blocks()]
    return Cloud(**{f.name: np.concatenate([getattr(c, f.name) for c in clouds]) for f in fields(Cloud)})
