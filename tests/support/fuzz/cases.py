"""Commands with a wrong file or a hostile word, by number: the same number and seed make the same case."""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path

import click

from support.fuzz.mutations import mutate
from tunneldb.cli.main import COMMANDS, main

# {new} is a name that is not taken, {stretch} a centimetre of the tunnel that has no profile yet, {out} a path in a folder of
# the case's own, {file} the file.
OF_FILES: tuple[tuple[str, str], ...] = (
    ("axis.csv", "tunnel add {new} --srid 25830 --axis {file}"),
    ("j-landxml.xml", "tunnel add {new} --srid 6677 --axis {file}"),
    ("indot-twin-branch.xml", "tunnel add {new} --srid 25830 --axis {file} --axis-unit meter"),
    ("aplitop-3.ifc", "tunnel add {new} --srid 25830 --axis {file}"),
    ("indot-twin-branch.ifc", "tunnel add {new} --srid 25830 --axis {file}"),
    ("axis.dxf", "tunnel add {new} --srid 25830 --axis {file} --axis-unit meter"),
    ("equations.csv", "tunnel stationing demo {file}"),
    ("trajectory.csv", "survey add {new} --tunnel demo --date 2024-05-04 --trajectory {file} --intensity-kind none"),
    ("stations.csv", "survey add {new} --tunnel demo --date 2024-05-04 --stations {file} --intensity-kind none"),
    ("cloud.ptx", "survey add {new} --tunnel demo --date 2024-05-04 --stations {file} --intensity-kind none"),
    ("reference.csv", "survey set scan-2024 --reference {file}"),
    ("cloud.las", "load scan-2024 {file}"),
    ("cloud.las", "inspect {file}"),
    ("cloud.laz", "inspect {file}"),
    ("cloud.ply", "inspect {file}"),
    ("cloud.ptx", "inspect {file}"),
    ("points.csv", "inspect {file}"),
    ("points.csv", "unroll demo-2024 {file} -o {out}.csv"),
    ("profile.csv", "profile add demo {new} {file} {stretch}"),
    ("profile.txt", "profile add demo {new} {file} --unit m {stretch} --layer shotcrete"),
    ("profile.dxf", "profile add demo {new} {file} {stretch}"),
    ("rings-points.csv", "rings --points {file} --axis {seeds}/rings-axis.csv --diameter 5.8 -o {out}.csv"),
    ("rings-axis.csv", "rings --points {seeds}/rings-points.csv --axis {file} --diameter 5.8 -o {out}.csv"),
    ("findings.csv", "findings import demo-2024 {file}"),
    ("truth.geojson", "findings import demo-2024 {file}"),
    ("control.csv", "spheres scan-2024 --radius 0.07 --control {file} --report {out}.md"),
    ("template.toml", "report demo-2024 --template {file} -o {out}.html"),
)
"""Files, and what reads them."""

OF_WORDS: tuple[str, ...] = (
    "leaks demo-2024", "leaks demo-2024 -o {out}.csv", "findings demo-2024", "findings demo-2024 -o {out}.gpkg",
    "deviation demo-2024 -o {out}.csv", "image demo-2024 -o {out}", "status demo-2024",
    "axis demo-2024 -o {out}.csv", "tunnel add {new} --srid 25830 --axis {seeds}/axis.csv", "qgis demo-2024 -o {out}.qgz",
    "export demo-2024 -o {out}.gpkg", "spheres scan-2024 --radius 0.07", "profile add demo {new} {seeds}/profile.csv {stretch}",
    "rings --points {seeds}/rings-points.csv --axis {seeds}/rings-axis.csv --diameter 5.8 -o {out}.csv",
)  # fmt: skip
"""Commands to which options with hostile values are added."""

VALUES = (
    "nan", "inf", "-inf", "1e308", "-1", "0", "", "x", "1,5", "0x1F", "\udcff", "a\nb", "'; DROP TABLE tunnel.tunnel; --", "%s",
    "/dev/null", "/", "9" * 400, "12+300", "-12+300", "12-10", "99:99-1:00", "=1+1", "٣",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A command; what is wrong with it."""

    words: list[str]
    wrong: str
    kind: str


def make_case(seed: int, number: int, seeds: Path, folder: Path) -> Case:
    """Return a case, and write its file into its folder."""
    chance = random.Random(seed * 1_000_003 + number)
    names = _names(number, seeds, folder)
    if chance.random() < 0.75:
        name, command = chance.choice(OF_FILES)
        text = Path(name).suffix not in {".las", ".laz"}
        data, wrong = mutate(chance, (seeds / name).read_bytes(), text=text)
        path = folder / name
        path.write_bytes(data)
        return Case(_words(command, file=str(path), **names), f"{name}: {wrong}", Path(name).suffix)
    words = _words(chance.choice(OF_WORDS), **names)
    command = _command(words)
    options = [o for o in command.params if isinstance(o, click.Option) and not o.is_flag and o.opts[0] != "--help"]
    option, value = chance.choice(options), chance.choice(VALUES)
    place = next((n + 1 for n, word in enumerate(words) if word in option.opts), None)
    if place is not None:
        words[place] = value
    elif option.nargs == 1:
        words += [option.opts[0], value]
    else:
        words += [option.opts[0], *chance.choices(VALUES, k=option.nargs)]
    return Case(words, f"{option.opts[0]} {value[:20]!r}", "words")


def right_cases(seeds: Path, folder: Path) -> list[Case]:
    """Return each command with the right file, to be done."""
    commands = (*OF_FILES, *(("", command) for command in OF_WORDS))
    return [
        Case(_words(command, file=str(seeds / name), **_names(10_000 + number, seeds, folder)), name, "right")
        for number, (name, command) in enumerate(commands)
    ]


def _names(number: int, seeds: Path, folder: Path) -> dict[str, str]:
    stretch = f"--layer excavation --from {12_310 + 0.015 * number:.3f} --to {12_310.01 + 0.015 * number:.3f}"
    return {"new": f"n{number}", "stretch": stretch, "out": str(folder / f"out{number}"), "seeds": str(seeds)}


def _words(command: str, **names: str) -> list[str]:
    return command.format(**names).split()


def _command(words: list[str]) -> click.Command:
    assert words[0] in COMMANDS
    context = click.Context(main)
    command = main.get_command(context, words[0])
    if isinstance(command, click.Group):
        command = command.get_command(context, words[1]) or command
    assert command is not None
    return command
