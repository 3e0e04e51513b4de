"""The plugin of QGIS: its zip, its algorithms against the command line, and a review by keys in real QGIS."""

from __future__ import annotations

import ast
import configparser
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import click
import psycopg
import pytest
from click.testing import CliRunner
from psycopg.conninfo import conninfo_to_dict
from support.coloured_image import add_image_in_colour
from support.qgis import ENVIRONMENT, PYTHON, has_qgis
from support.system import missing

import tunneldb
from tunneldb.cli.main import main

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "qgis_plugin" / "tunneldb_review"


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The zip, as QGIS unpacks it."""
    folder = tmp_path_factory.mktemp("plugin")
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "package_plugin.py"), str(folder)], capture_output=True, text=True, check=True
    )
    archive = Path(done.stdout.strip())
    assert archive.name == f"tunneldb_review-{tunneldb.__version__}.zip"
    with zipfile.ZipFile(archive) as held:
        held.extractall(folder / "plugins")
    return folder / "plugins"


def test_the_zip_holds_the_plugin_and_its_licence_in_one_folder(unpacked: Path) -> None:
    (folder,) = unpacked.iterdir()
    held = {path.name for path in folder.iterdir()}
    assert held == {path.name for path in SOURCE.glob("*.py")} | {"catalogue.py", "metadata.txt", "icon.svg", "LICENSE"}
    assert f"\nversion={tunneldb.__version__}\n" in (folder / "metadata.txt").read_text("utf-8")


@pytest.mark.slow
def test_what_is_published_keeps_the_rules_of_plugins_qgis_org(tmp_path: Path) -> None:
    """Rules of its validator that need no network; the pages must be reachable, too."""
    told = {
        "email": "a@example.org", "homepage": "https://example.org/tunneldb", "repository": "https://example.org/tunneldb/code",
        "tracker": "https://example.org/tunneldb/issues",
    }  # fmt: skip
    script = [sys.executable, str(ROOT / "scripts" / "package_plugin.py"), str(tmp_path)]
    some = subprocess.run([*script, "--email", told["email"]], capture_output=True, text=True, check=False)
    assert some.returncode == 2
    assert "--homepage, --repository, --tracker" in some.stderr
    words = [word for name, value in told.items() for word in (f"--{name}", value)]
    archive = Path(subprocess.run([*script, *words], capture_output=True, text=True, check=True).stdout.strip())
    assert archive.stat().st_size < 20_000_000
    with zipfile.ZipFile(archive) as held:
        names = held.namelist()
        parser = configparser.ConfigParser()
        parser.optionxform = str  # type: ignore[assignment,method-assign]
        parser.read_string(held.read("tunneldb_review/metadata.txt").decode())
    metadata = dict(parser["general"])
    assert {"tunneldb_review/__init__.py", "tunneldb_review/LICENSE", f"tunneldb_review/{metadata['icon']}"} <= set(names)
    assert not [name for name in names if ".." in name or ".pyc" in name or "__pycache__" in name or name.startswith("/")]
    assert {"name", "description", "version", "qgisMinimumVersion", "author", "about", *told} <= set(metadata)
    assert told.items() <= metadata.items()
    assert "/" not in metadata["author"]
    assert "plugin" not in metadata["name"].lower()
    assert all(metadata[key] in ("True", "False") for key in ("experimental", "deprecated"))
    assert tuple(map(int, metadata["qgisMinimumVersion"].split("."))) <= (3, 22)


def test_it_is_python_of_3_9_and_imports_nothing_that_qgis_lacks(unpacked: Path) -> None:
    for path in (unpacked / "tunneldb_review").glob("*.py"):
        tree = ast.parse(path.read_text("utf-8"), feature_version=(3, 9))
        imported = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and not node.level}
        imported |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
        strange = {name.split(".")[0] for name in imported} - {"qgis", *sys.stdlib_module_names}
        assert not strange, f"{path.name}: {strange}"


def test_options_of_algorithms_are_those_of_the_command_line(unpacked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(unpacked))
    from tunneldb_review.catalogue import COMMANDS

    assert len({command.name for command in COMMANDS}) == len(COMMANDS)
    for command in COMMANDS:
        context, found = click.Context(main), main
        for word in (word for word in command.words if not word.startswith("-")):
            assert isinstance(found, click.Group)
            found = found.get_command(context, word)  # type: ignore[assignment]
        assert found.name == [word for word in command.words if not word.startswith("-")][-1]
        known = {option: p for p in found.params if isinstance(p, click.Option) for option in (*p.opts, *p.secondary_opts)}
        given = {parameter.option.split()[0]: parameter for parameter in command.parameters if parameter.option}
        assert set(given) <= set(known), command.name
        words = {word for word in command.words if word.startswith("-")}
        needed = {p.opts[0] for p in known.values() if p.required}
        assert needed <= {option for name in {*given, *words} for option in known[name].opts}, command.name
        for name, parameter in given.items():
            theirs = known[name].type
            if parameter.choices and isinstance(theirs, click.Choice):
                assert set(parameter.choices) <= set(theirs.choices), f"{command.name} {name}"
            assert (parameter.kind == "flag" and " " not in parameter.option) == known[name].is_flag, f"{command.name} {name}"


def test_calls_are_put_together_and_lines_are_read(unpacked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(unpacked))
    from tunneldb_review.commands import COMMANDS, arguments_of, error_of, progress_of
    from tunneldb_review.connection import dsn, of_source

    run = next(command for command in COMMANDS if command.name == "run")
    words = arguments_of(run, {"SURVEY": "-a", "FROM": "detect", "SET": "leak.min_area=0.1; x=2", "STALE": True})
    assert words == ["run", "--from", "detect", "--set", "leak.min_area=0.1", "--set", "x=2", "--stale", "--", "-a"]
    with pytest.raises(ValueError, match="Survey"):
        arguments_of(run, {})
    assert progress_of("[2/5] axis km 12: 3 vertices") == 0.4
    assert progress_of("axis") is None
    assert error_of("note\ntunneldb: there is no survey 'x'\n") == "there is no survey 'x'"
    source = "dbname='a b' host=/run/x port=5432 user='ines' password='secret' key='id' table=\"tunnel_api\".\"leak\""
    assert dsn(of_source(source).words) == "dbname='a b' host=/run/x port=5432 user=ines"


def in_qgis(unpacked: Path, folder: Path, dsn: str, person: str, script: str = "review_in_qgis.py") -> dict[str, Any]:
    """What real QGIS does with the plugin as a person, in a project whose service names that person."""
    if not has_qgis():
        missing("QGIS")
    lines = []
    for service, user in (("review", {"user": person}), ("owner", {})):
        lines += [f"[{service}]", *(f"{key}={value}" for key, value in (conninfo_to_dict(dsn) | user).items())]
    (folder / "pg_service.conf").write_text("\n".join([*lines, ""]))
    project = folder / "demo.qgz"
    result = CliRunner().invoke(main, ["--dsn", dsn, "qgis", "demo-2024", "-o", str(project), "--service", "review"])
    assert result.exit_code == 0, result.output
    command = folder / "tunneldb"
    command.write_text(
        f"#!/bin/sh\nPYTHONPATH='{Path(tunneldb.__file__).parents[1]}' exec '{sys.executable}' -c"
        ' "from tunneldb.cli.main import main; main()" "$@"\n'
    )
    command.chmod(0o755)
    environment = ENVIRONMENT | {"HOME": str(folder), "PGSERVICEFILE": str(folder / "pg_service.conf")}
    arguments = [project, unpacked, command, folder, *(["look"] if person == "vera" else [])]
    done = subprocess.run(
        [PYTHON, str(Path(__file__).with_name(script)), *map(str, arguments)],
        env=environment, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return seen


def test_an_inspector_reviews_by_keys(
    unpacked: Path, tmp_path: Path, conn: psycopg.Connection, dsn: str, example: str, people: None
) -> None:
    seen = in_qgis(unpacked, tmp_path, dsn, "ines")
    assert seen["loaded"]["version"] == tunneldb.__version__
    assert {"tunneldb:run", "tunneldb:batch", "tunneldb:evaluate", "tunneldb:report"} <= set(seen["loaded"]["algorithms"])
    did = seen["review"]
    assert did["pictures"] == {"raw": True, "corrected": True, "rgb": False, "offset": True}
    assert did["followed"]
    assert did["first"] == did["previous"] != did["next"] == did["after_confirm"] == did["rejected"]
    assert did["focus_back"]
    assert did["after_undo"] == did["undone"]
    assert "undone" in did["said"]
    (statement,) = conn.execute("SELECT tunnel_api.coverage_statement(1)").fetchone()  # type: ignore[misc]
    assert did["coverage"] == [statement, ""], "the second is of kilometres beyond the survey"
    assert statement
    rows = {key: rest for key, *rest in conn.execute("SELECT id, review, kind, remark, reviewed_by FROM tunnel_api.finding")}
    assert rows[did["first"]][0] == "confirmed"
    assert rows[did["rejected"]][0] == "rejected"
    assert rows[did["renamed"]] == ["confirmed", "efflorescence", "it's a \\ 'trap'; no CR", "ines"]
    assert rows[did["undone"]][0] == "open"
    who = conn.execute("SELECT DISTINCT who FROM tunnel_api.audit WHERE view = 'finding'").fetchall()
    assert who == [("ines",)]
    (large,) = conn.execute(  # type: ignore[misc]
        "SELECT count(*) FROM tunnel_api.finding WHERE survey = %s AND area >= 1"
        " AND state IN ('open', 'confirmed', 'rejected', 'gone')", [example],
    ).fetchone()  # fmt: skip
    assert len(did["large"]) == large

    assert len(seen["images"]["changed"]) == 1
    assert seen["images"]["again"] == []
    assert seen["images"]["new"]
    assert seen["images"]["drawn_as_before"]
    assert seen["leaks"]["EXIT_CODE"] in (0, 1)
    assert "leak_unrolled" in seen["leaks"]["loaded"]
    assert re.match(r"there is no survey 'nowhere-2024'", seen["wrong"]["error"])
    assert seen["left"] == []
    assert not [key for key in seen["settings"] if "password" in key]


def test_a_viewer_sees_the_images_and_is_told_that_she_may_not(
    unpacked: Path, tmp_path: Path, conn: psycopg.Connection, dsn: str, example: str, people: None
) -> None:
    add_image_in_colour(conn, example)
    seen = in_qgis(unpacked, tmp_path, dsn, "vera")
    assert seen["pictures"] == dict.fromkeys(("raw", "corrected", "rgb", "offset"), True)
    assert "may look, but not review" in seen["refused"]
    assert conn.execute("SELECT count(*) FROM tunnel_api.audit WHERE who = 'vera'").fetchone() == (0,)


def test_what_comes_between_loses_nothing_and_overwrites_nothing(
    unpacked: Path, tmp_path: Path, conn: psycopg.Connection, dsn: str, example: str, people: None
) -> None:
    """The server goes away, another reviews the same, letters are typed in lists, a command is cancelled in a stage."""
    conn.close()  # the database is closed to all for a while
    seen = in_qgis(unpacked, tmp_path, dsn, "ines", "interrupted_in_qgis.py")
    assert seen["lists"] == {"reviewed": 0, "order": "By chainage", "keys": True}

    lost, two = seen["lost"], seen["two"]
    assert lost["cut_said"] == ""
    assert lost["lost"] != lost["cut"]
    for said, listed, shown, review in lost["away"]:
        assert said.startswith("No connection to the database")
        assert (listed, shown, review) == (lost["lost"], lost["lost"], "open")
    assert "was not written" in lost["remark_kept"][0]
    assert lost["remark_kept"][1:] == ["wet again", True]
    with psycopg.connect(dsn) as connection:
        rows = {
            key: rest for key, *rest in connection.execute("SELECT id, review, remark, reviewed_by FROM tunnel_api.finding")
        }
        assert rows[lost["cut"]] == ["confirmed", None, "ines"]
        assert rows[lost["lost"]] == ["confirmed", "wet again", "ines"]
        assert rows[two["first"]] == ["confirmed", "no soot", "ines"]
        audit = connection.execute(
            "SELECT before ->> 'review', before ->> 'remark', after ->> 'review', after ->> 'remark' FROM tunnel_api.audit"
            " WHERE view = 'finding' AND row_id = %s ORDER BY id", [two["first"]],
        ).fetchall()  # fmt: skip
        assert audit == [
            ("open", None, "rejected", "soot"), (None, "soot", None, "no soot"), ("rejected", None, "confirmed", None),
        ]  # fmt: skip

    changed = (
        rf"\w+ has changed finding {two['first']} in the meantime: it is rejected, .+, remark “soot”\. Nothing was written"
    )
    assert re.match(changed, two["said"])
    assert (two["stays"], two["shown"], two["kept"]) == (two["first"], ["rejected", "soot", True], "rejected|soot")
    assert (two["came"], two["listed"]) == (two["wanted"], False)

    assert seen["rerun"].pop("said").endswith("; findings were reloaded.")
    assert seen["rerun"] == {"stays": True, "new": True}
    for said in (lost["read_again"], seen["ended"]):
        assert said.endswith("; findings of the dock were not reloaded."), (lost["read_again"], seen["ended"])

    assert seen["not_entered"] == {
        "before": ["", "confirmed|"], "same": [True, "drips", "open|"], "with": "confirmed|drips",
        "other": [True, True, "", "open|", "open|old stain"], "then": [True, "", "open|"],
    }  # fmt: skip

    cancelled = seen["cancel"]
    assert (cancelled["children"], cancelled["left"], cancelled["backends"]) == (1, 0, 0)
    assert cancelled["after"] == cancelled["before"]
    assert "Cancelled" in cancelled["log"]


def test_what_another_wrote_alike_is_no_step_of_the_dock(
    unpacked: Path, tmp_path: Path, conn: psycopg.Connection, dsn: str, example: str, people: None
) -> None:
    """An operator, who may take back what others did, says of a finding what an inspector has just said."""
    seen = in_qgis(unpacked, tmp_path, dsn, "otto", "together_in_qgis.py")
    rows = {key: rest for key, *rest in conn.execute("SELECT id, review, reviewed_by FROM tunnel_api.finding")}
    assert seen["at_once"]["waited"]
    for how in ("ines", "at_once"):
        confirmed, undone = seen[how]["confirmed"], seen[how]["undone"]
        assert [confirmed[name] for name in ("went_on", "steps", "counted", "said")] == [True, 0, 0, ""], how
        assert "there is no review to undo" in undone["said"], how
        assert rows[confirmed["finding"]] == ["confirmed", "ines"], how
    confirmed, undone = seen["otto"]["confirmed"], seen["otto"]["undone"]  # as if the answer had been lost
    assert (confirmed["steps"], confirmed["counted"], undone["steps"]) == (1, 1, -1)
    assert "undone" in undone["said"]
    assert rows[confirmed["finding"]] == ["open", None]
