"""Commands with a wrong file, a hostile word, or after a hostile statement; a number and a seed always make the same case."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from support.fuzz.mutations import mutate
from support.fuzz.sources import make_source
from support.fuzz.writes import Rights, make_call, make_write
from tunneldb.cli.main import main

# {new} is a name that is not taken, {stretch} where a profile is to hold, {out} a path in a folder of the case's own, {file}
# the file, {seeds} the folder of the right ones.
OF_FILES: tuple[tuple[str, str], ...] = (
    ("axis.csv", "tunnel add {new} --srid 25830 --axis {file}"),
    ("equations.csv", "tunnel add {new} --srid 25830 --axis {seeds}/axis.csv --start-chainage 12300 --stationing {file}"),
    ("j-landxml.xml", "tunnel add {new} --srid 6677 --axis {file}"),
    ("indot-twin-branch.xml", "tunnel add {new} --srid 25830 --axis {file} --axis-unit meter"),
    ("aplitop-3.ifc", "tunnel add {new} --srid 25830 --axis {file}"),
    ("indot-twin-branch.ifc", "tunnel add {new} --srid 25830 --axis {file}"),
    ("axis.dxf", "tunnel add {new} --srid 25830 --axis {file} --axis-unit meter"),
    ("cloud.las", "tunnel add {new} {file} --srid 25830 --axis {seeds}/axis.csv"),
    ("cloud.las", "tunnel find-axis {file} -o {out}.csv"),
    ("equations.csv", "tunnel stationing demo {file}"),
    ("trajectory.csv", "survey add {new} --tunnel demo --date 2024-05-04 --trajectory {file} --intensity-kind none"),
    ("stations.csv", "survey add {new} --tunnel demo --date 2024-05-04 --stations {file} --intensity-kind none"),
    ("cloud.ptx", "survey add {new} --tunnel demo --date 2024-05-04 --stations {file} --intensity-kind none"),
    ("stations.csv", "survey set scan-2024 --stations {file}"),
    ("trajectory.csv", "survey set walk-2024 --trajectory {file}"),
    ("reference.csv", "survey set scan-2024 --reference {file}"),
    ("survey.tdb", "survey import {file} --name {new}"),
    ("cloud.las", "survey remove-file demo-2024 {file} --yes"),
    ("cloud.las", "load scan-2024 {file}"),
    ("cloud.las", "batch scan-2024 {file} --preview"),
    ("cloud.las", "inspect {file}"),
    ("cloud.laz", "inspect {file}"),
    ("cloud.e57", "inspect {file}"),
    ("cloud.ply", "inspect {file}"),
    ("cloud.ptx", "inspect {file}"),
    ("points.csv", "inspect {file}"),
    ("cloud.las", "ground {file} -o {out}.laz"),
    ("points.csv", "unroll demo-2024 {file} -o {out}.csv"),
    ("profile.csv", "profile add demo {new} {file} {stretch}"),
    ("profile.txt", "profile add demo {new} {file} --unit m {stretch} --layer shotcrete"),
    ("profile.dxf", "profile add demo {new} {file} {stretch}"),
    ("rings-points.csv", "rings --points {file} --axis {seeds}/rings-axis.csv --diameter 5.8 -o {out}.csv"),
    ("rings-axis.csv", "rings --points {seeds}/rings-points.csv --axis {file} --diameter 5.8 -o {out}.csv"),
    ("rings.csv", "rings demo-2024 --rings {file}"),
    ("profile.csv", "clearance demo-2024 --gauge {file} --track single"),
    ("trajectory.csv", "clearance demo-2024 --gauge {seeds}/profile.csv --track-axis {file}"),
    ("findings.csv", "findings import demo-2024 {file}"),
    ("truth.geojson", "findings import demo-2024 {file}"),
    ("axis.dxf", "findings import demo-2024 {file} --kind crack"),
    ("mask.png", "findings trace demo-2024 {file} --points {seeds}/mask-points.csv"),
    ("mask-points.csv", "findings trace demo-2024 {seeds}/mask.png --points {file}"),
    ("truth.geojson", "evaluate demo-2024 {file}"),
    ("control.csv", "spheres scan-2024 --radius 0.07 --control {file} --report {out}.md"),
    ("ladders.csv", "register scan-2024 {seeds}/points.csv --ladders {file} --up +z --water-level 600"),
    ("points.csv", "register scan-2024 {file} --ladders {seeds}/ladders.csv --up +z --water-level 600"),
    (
        "start.csv",
        "register scan-2024 {seeds}/points.csv --ladders {seeds}/ladders.csv --start {file} --up +z --water-level 600",
    ),
    ("cloud.las", "members {file} --stations {seeds}/stations.csv --intensity intensity --intensity-kind linear -o {out}.gpkg"),
    ("stations.csv", "members {seeds}/cloud.las --stations {file} --intensity intensity --intensity-kind linear -o {out}.gpkg"),
    ("axis.csv", "serve --no-open --port 0 --certificate {file} --key {seeds}/axis.csv"),
    ("axis.csv", "serve --no-open --port 0 --certificate {seeds}/axis.csv --key {file}"),
    ("signed.html", "report --verify {file}"),
    ("template.toml", "report demo-2024 --template {file} -o {out}.html"),
    ("elements.csv", "elements add demo {new} --file {file}"),
    ("rating.toml", "rating add {file}"),
    ("actions.csv", "actions import demo {file}"),
    ("strip.tif", "image import demo-2024 {file} --kind thermal --pixel 0.1"),
    ("image-points.csv", "image import demo-2024 {seeds}/strip.tif --kind thermal --pixel 0.1 --points {file}"),
    ("frames.csv", "image import demo-2024 {file} --kind thermal --pixel 0.1"),
)
"""Files, and what reads them: each command and option that takes a file is among them."""

OF_WORDS: tuple[str, ...] = (
    "tunnel list", "tunnel add {new} --srid 25830 --axis {seeds}/axis.csv", "tunnel stationing demo --show",
    "tunnel remove {new}",
    "survey list", "survey add {new} --tunnel demo --date 2024-05-04 --stations {seeds}/stations.csv --intensity-kind none",
    "survey set scan-2024 --date 2024-05-05", "survey remove scan-2024 --yes", "survey export demo-2024 -o {out}.tdb",
    "survey import {seeds}/survey.tdb --name {new}", "survey sizes", "prune", "vacuum",
    "federate list", "federate add {new} --dsn postgresql://vera@127.0.0.1:9/tunneldb", "federate remove {new}",
    "load scan-2024 {seeds}/cloud.las", "run demo-2024",
    "batch scan-2024 {seeds}/cloud.las --preview", "stop", "status demo-2024", "check",
    "leaks demo-2024", "leaks demo-2024 -o {out}.csv", "findings list demo-2024", "findings list demo-2024 -o {out}.gpkg",
    "findings undo 1", "findings import demo-2024 {seeds}/findings.csv",
    "findings trace demo-2024 {seeds}/mask.png --points {seeds}/mask-points.csv", "findings searched demo-2024",
    "findings searched demo-2024 --from 12+310 --to 12+320 --source photos", "learn demo-2024",
    "learn demo-2024 --list", "evaluate demo-2024 {seeds}/truth.geojson", "spots demo-2024",
    "members demo-2024", "spheres scan-2024 --radius 0.07", "axis demo-2024 -o {out}.csv",
    "rings --points {seeds}/rings-points.csv --axis {seeds}/rings-axis.csv --diameter 5.8 -o {out}.csv", "rings demo-2024",
    "sections demo-2024 --from 12+300 --to 12+310 --every 5 -o {out}.csv",
    "profile add demo {new} {seeds}/profile.csv {stretch}", "profile list demo", "profile remove demo {new}",
    "elements add demo {new} --joints demo-2024",
    "elements add demo {new} --length 10", "elements cracks demo-2024 blocks",
    "elements list demo", "elements remove demo {new}", "rating list",
    "rating show example", "rating remove {new} 1", "rating apply demo-2024 --elements blocks --scheme example",
    "rating compare demo-2024 --elements blocks --scheme example --scheme example:1",
    "rating change demo-2024 --elements blocks --scheme example",
    "actions list demo", "actions add demo-2024 --measure seal --from 12+310 --to 12+320", "actions set 1 --state done",
    "actions remove 999", "actions export demo -o {out}.xlsx",
    "alarms add demo {new} --quantity ovality --warning 0.01 --alarm 0.02", "alarms list demo", "alarms remove demo {new}",
    "alarms add demo {new} --quantity convergence --warning 0.01 --alarm 0.02", "alarms check demo -o {out}.csv",
    "alarms add demo {new} --quantity growth --step 50 --warning 0.01 --alarm 0.02",
    "deviation demo-2024 -o {out}.csv", "thickness demo-2024 scan-2024", "evenness demo-2024", "compare demo-2024 scan-2024",
    "clearance demo-2024 --gauge {seeds}/profile.csv --track single", "unroll demo-2024 {seeds}/points.csv",
    "ground {seeds}/cloud.las -o {out}.laz", "intensity demo-2024 -o {out}.png", "image write demo-2024 -o {out}",
    "image import demo-2024 {seeds}/strip.tif --kind thermal --pixel 0.1", "image list demo-2024",
    "image remove demo-2024 {new}", "export demo-2024 -o {out}.gpkg", "export demo-2024 -o {out}.dxf",
    "export scan-2024 --classified --copc -o {out}.d", "qgis demo-2024 -o {out}.qgz",
    "report demo-2024 -o {out}.html --from 12310 --to 12320",
    "register scan-2024 {seeds}/points.csv --ladders {seeds}/ladders.csv --up +z --water-level 600",
    "simulate {out}.d --length 10 --density 5", "simulate-structure {out}.d --stations 1 --angular-step 1",
    "simulate-canal {out}.d --length 10 --laser-stations 1 --sonar-stations 1 --laser-step 1 --sonar-step 1",
)  # fmt: skip
"""Commands to which options with hostile values are added: each command is among them or in OF_FILES."""

UNTRIED = {
    "init": "has no options",
    "inspect": "has no options",
    "rating add": "what goes wrong lies in its file",
    "actions import": "what goes wrong lies in its file",
    "survey remove-file": "has no options but the file",
    "tunnel find-axis": "what goes wrong lies in its file",
    "serve": "serves until it is told to leave",
    "federate check": "repeats until it is stopped",
    "worker": "works until it is told to leave",
    "psql": "hands its words on to another program",
    "server start": "has no options",
    "server status": "has no options",
    "server stop": "has no options, and stops the tests' own server",
}
"""Verbs that are in none of OF_WORDS, and why."""

REFUSED = (
    "actions remove", "alarms remove", "clearance", "compare", "elements remove", "evaluate", "export scan-2024",
    "federate add", "federate remove", "findings undo", "ground", "image remove", "intensity", "learn demo-2024",
    "members demo", "profile remove", "rating change", "rating remove", "register", "run", "serve", "spheres",
    "survey remove-file", "thickness", "tunnel add {new} {file}", "tunnel find-axis", "tunnel remove",
)  # fmt: skip
"""What right commands begin with that the survey made by hand has no rows for: they are to say so in one line."""

VALUES = (
    "nan", "inf", "-inf", "1e308", "-1", "0", "", "x", "1,5", "0x1F", "\udcff", "a\nb", "'; DROP TABLE tunnel.tunnel; --", "%s",
    "/dev/null", "/", "9" * 400, "12+300", "-12+300", "12-10", "99:99-1:00", "=1+1", "٣",
)  # fmt: skip


AFTER_WRITES: tuple[str, ...] = (
    "status", "status demo-2024", "check", "leaks demo-2024", "leaks demo-2024 -o {out}.xlsx",
    "findings list demo-2024 --state all",
    "findings list demo-2024 -o {out}.gpkg", "run demo-2024 --stale", "batch demo-2024 --preview", "learn demo-2024",
    "evaluate demo-2024 {seeds}/truth.geojson", "export demo-2024 -o {out}.gpkg", "export demo-2024 -o {out}.dxf",
    "qgis demo-2024 -o {out}.qgz", "report demo-2024 -o {out}.html", "image write demo-2024 -o {out}",
    "sections demo-2024 --from 12+300 --to 12+310 --every 5 -o {out}.csv", "axis demo-2024 -o {out}.csv",
    "survey export demo-2024 -o {out}.tdb", "unroll demo-2024 {seeds}/points.csv",
)  # fmt: skip
"""Commands that are run after an extreme value was taken."""

DRIP = "report demo-2024 -o {out}.html --from 12310 --to 12320 --photo-server {server}"
"""The command that reads from a server of photos."""


@dataclass(frozen=True)
class Case:
    """A command, what is wrong with it, and a statement that somebody has run before it; only the statement if no command."""

    words: list[str]
    wrong: str
    kind: str
    login: str = ""
    statement: str = ""


@dataclass(frozen=True)
class Ground:
    """What cases are made from: the folder of right files, what people may do, and host and port of a server that drips."""

    seeds: Path
    rights: Sequence[Rights]
    server: str


def make_case(seed: int, number: int, ground: Ground, folder: Path) -> Case:
    """Return a case, and write its file into its folder."""
    chance = random.Random(seed * 1_000_003 + number)
    seeds = ground.seeds
    names = _names(number, seeds, folder)
    kind = chance.choices(("file", "words", "write", "call", "source", "server"), SHARES)[0]
    if kind == "write":
        login, statement = make_write(chance, ground.rights)
        return Case(_words(chance.choice(AFTER_WRITES), **names), statement, kind, login, statement)
    if kind == "call":
        login, statement = make_call(chance, ground.rights)
        return Case([], statement, kind, login, statement)
    if kind == "source":
        name, command = chance.choice(OF_FILES)
        wrong = make_source(chance, folder / name, (seeds / name).read_bytes())
        return Case(_words(command, file=str(folder / name), **names), f"{name}: {wrong}", kind)
    if kind == "server":
        statement = f"INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (1, 'http://{ground.server}/a.jpg')"
        return Case(_words(DRIP, server=ground.server, **names), "photo from a server that drips", kind, "ines", statement)
    if kind == "file":
        name, command = chance.choice(OF_FILES)
        text = Path(name).suffix not in {".las", ".laz", ".e57", ".tdb", ".tif"}
        data, wrong = mutate(chance, (seeds / name).read_bytes(), text=text)
        path = folder / name
        path.write_bytes(data)
        return Case(_words(command, file=str(path), **names), f"{name}: {wrong}", Path(name).suffix)
    words = _words(chance.choice(OF_WORDS), **names)
    wrong = _hostile_option(chance, words) if chance.random() < 0.9 else _hostile_word(chance, words)
    return Case(words, wrong, "words")


SHARES = (0.45, 0.22, 0.2, 0.08, 0.047, 0.003)
"""Share of cases with a malformed file, a hostile word, an extreme value or argument, a source, and a server that drips."""


def _hostile_option(chance: random.Random, words: list[str]) -> str:
    """Give a hostile value to an option, or put a flag where it may not fit; return what was done."""
    options = [o for o in command_of(words).params if isinstance(o, click.Option) and o.opts[0] != "--help"]
    option, value = chance.choice(options), chance.choice(VALUES)
    if option.is_flag:
        words.append(option.opts[0])
        return option.opts[0]
    place = next((n + 1 for n, word in enumerate(words) if word in option.opts), None)
    if place is not None:
        words[place] = value
    elif option.nargs == 1:
        words += [option.opts[0], value]
    else:
        words += [option.opts[0], *chance.choices(VALUES, k=option.nargs)]
    return f"{option.opts[0]} {value[:20]!r}"


def _hostile_word(chance: random.Random, words: list[str]) -> str:
    """Put a hostile value in the place of a word that is no command."""
    first = len(verb_of(words).split())
    place, value = chance.randrange(first, len(words) + 1), chance.choice(VALUES)
    words[place : place + 1] = [value]
    return f"word {place} {value[:20]!r}"


def right_cases(seeds: Path, folder: Path) -> list[Case]:
    """Return each command with the right file: to be done, or refused in one line where it stands in REFUSED."""
    commands = (*OF_FILES, *(("", command) for command in OF_WORDS))
    return [
        Case(
            _words(command, file=str(seeds / name), **_names(number, seeds, folder)),
            name,
            "refused" if command.startswith(REFUSED) and "--list" not in command else "right",
        )
        for number, (name, command) in enumerate(commands)
    ]


def _names(number: int, seeds: Path, folder: Path) -> dict[str, str]:
    stretch = "--layer excavation --from 12310 --to 12311"
    return {"new": f"n{number}", "stretch": stretch, "out": str(folder / f"out{number}"), "seeds": str(seeds)}


def _words(command: str, **names: str) -> list[str]:
    return command.format(**names).split()


def verb_of(words: list[str]) -> str:
    """Words that name the command, as ``tunnel add``."""
    return " ".join(words[:2] if isinstance(_first(words), click.Group) else words[:1])


def command_of(words: list[str]) -> click.Command:
    """Return the command that words begin with."""
    command = _first(words)
    if isinstance(command, click.Group):
        command = command.get_command(click.Context(main), words[1]) or command
    return command


def _first(words: list[str]) -> click.Command:
    command = main.get_command(click.Context(main), words[0])
    assert command is not None, words[0]
    return command
