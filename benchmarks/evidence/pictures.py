"""Pictures of tunnels whose truth is known: made by the stages before detection, and kept in files."""

from __future__ import annotations

import importlib
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np

from benchmarks.blind import run as blind
from benchmarks.blind.run import Outcome
from benchmarks.common import progress, scratch_database
from benchmarks.leak_set import SET, Truth, prepare
from tunneldb.database import connect
from tunneldb.pipeline import detect as stage
from tunneldb.raster.image import LiningImage


def pictures(family: str, folder: Path, dsn: str | None, only: str = "") -> Iterator[tuple[LiningImage, Outcome]]:
    """Pictures of a round of scenes, or of the leak set (``set-SEED``), and their truth; of those with a word in their name.

    Those in the folder are not made again. Scenes that the program refuses have none, but a file ``SCENE.refused``, without
    which they are tried again.
    """
    here = folder / family
    here.mkdir(parents=True, exist_ok=True)
    for name in names(family):
        path, refused = here / f"{name}.pickle", here / f"{name}.refused"
        if only not in name or refused.is_file():
            continue
        if not path.is_file():
            progress(f"{family} {name}")
            with scratch_database(dsn) as database:
                made = (
                    _of_set(family, name, here, database)
                    if family.startswith("set")
                    else _of_round(family, name, here, database)
                )
            if made is None:
                progress(f"{family} {name} was refused")
                refused.touch()
                continue
            path.write_bytes(pickle.dumps(made))
        yield pickle.loads(path.read_bytes())


def names(family: str) -> list[str]:
    """Names of the tunnels of a family."""
    if family.startswith("set"):
        return [case.name for case in SET]
    return [scene.name for scene in importlib.import_module(f"benchmarks.blind.{family}").SCENES]


def _of_round(family: str, name: str, folder: Path, dsn: str) -> tuple[LiningImage, Outcome] | None:
    (scene,) = (one for one in importlib.import_module(f"benchmarks.blind.{family}").SCENES if one.name == name)
    files = folder / name
    blind.make(scene, files)
    with mock.patch.object(blind, "tunneldb", _here):
        picture, seconds = _tapped(lambda: blind.run(scene, files, dsn))
    if picture is None:
        return None
    with connect(dsn) as conn:
        return picture, blind.outcome(conn, scene, files, seconds)


def _of_set(family: str, name: str, folder: Path, dsn: str) -> tuple[LiningImage, Outcome] | None:
    (case,) = (one for one in SET if one.name == name)
    scene = prepare(case, int(family.partition("-")[2]), folder, dsn)
    picture, seconds = _tapped(lambda: _here("run", scene.name, "--from", "detect", dsn=dsn))
    if picture is None:
        return None
    truth = Truth.of(scene)
    nothing: list[str] = [""] * len(truth.leaks)
    return picture, Outcome(
        name, str(case.options["lining"]), "leak set", truth.leaks, truth.drops.tolist(), nothing, nothing, [], [], [], [], 0.0,
        seconds, truth.dry, truth.kinds,
    )  # fmt: skip


def _tapped(work: Callable[[], float]) -> tuple[LiningImage | None, float]:
    """Do something that seeks leaks in this process; return the picture in which they were sought, and what was returned.

    No picture where it was refused. Pictures after the first are those of trials of detectability: leaks were added to them.
    """
    seen: list[LiningImage] = []

    def tap(picture: LiningImage, *rest: object) -> object:
        seen.append(replace(picture, state=picture.state.copy(), level=picture.level.copy()))
        return original(picture, *rest)

    original = stage.relate
    with mock.patch.object(stage, "relate", tap):
        try:
            out = work()
        except SystemExit:
            return None, np.nan
    return seen[0], out


def _here(*words: object, dsn: str | None = None) -> float:
    """Run a command in this process."""
    from tunneldb.cli.main import main

    environment = {"TUNNELDB_DSN": dsn} if dsn else {}
    with mock.patch.object(sys, "argv", ["tunneldb", *map(str, words)]), mock.patch.dict(os.environ, environment):
        try:
            main()
        except SystemExit as end:
            if end.code not in (0, 1, None):
                raise
    return 0.0
