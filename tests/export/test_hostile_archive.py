"""Archives whose checksums are right and whose rows are not: of others, of too many, bombs. Nothing of them is written."""

from __future__ import annotations

import hashlib
import json
import resource
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import psycopg
import pytest
import zstandard
from click.testing import CliRunner

from tunneldb.cli.main import main
from tunneldb.store.survey import get_survey

Change = Callable[[bytes], bytes]


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def forge(path: Path, member: str, change: Change, packed: Change | None = None, *, told: bool = True) -> Path:
    """The archive with a member changed, and a manifest that says so; or, not told, says what it said."""
    new = path.with_name("forged.tdb")
    with zipfile.ZipFile(path) as held, zipfile.ZipFile(new, "w") as out:
        manifest = json.loads(held.read("manifest.json"))
        for name in held.namelist():
            data = held.read(name)
            if name == member:
                rows = change(zstandard.ZstdDecompressor().decompressobj().decompress(data))
                if told:
                    manifest["members"][name] |= {"bytes": len(rows), "sha256": hashlib.sha256(rows).hexdigest()}
                data = packed(rows) if packed else zstandard.ZstdCompressor().compress(rows)
            if name != "manifest.json":
                out.writestr(name, data)
        out.writestr("manifest.json", json.dumps(manifest))
    return new


def bomb(size: int) -> Change:
    return lambda rows: bytes(size)


def window(rows: bytes) -> bytes:
    """A frame that wants a window of 2³⁰ bytes to be unpacked."""
    parameters = zstandard.ZstdCompressionParameters(window_log=30, hash_log=6, chain_log=6, strategy=zstandard.STRATEGY_FAST)
    packer = zstandard.ZstdCompressor(compression_params=parameters).compressobj()
    return packer.compress(rows) + packer.flush()


def test_nothing_of_a_forged_archive_is_written(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    mine = get_survey(conn, example).id
    conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform, reference)"
        " SELECT tunnel_id, 'theirs', date, 'none', platform, 'none' FROM tunnel.survey WHERE id = %s",
        [mine],
    )
    theirs = get_survey(conn, "theirs").id
    conn.commit()
    path = tmp_path / "demo.tdb"
    assert CliRunner().invoke(main, ["survey", "export", example, "-o", str(path)]).exit_code == 0
    number = struct.Struct(">ii")  # a field of four bytes, as COPY has it

    def of_theirs(rows: bytes) -> bytes:
        assert number.pack(4, mine) in rows
        return rows.replace(number.pack(4, mine), number.pack(4, theirs))

    def twice(rows: bytes) -> bytes:
        return rows[:-2] + rows[19:]  # header of 19 bytes, an end of two

    forged = {
        "rows of another survey": lambda: forge(path, "rows/segment.zst", of_theirs),
        "findings of another survey": lambda: forge(path, "rows/finding.zst", of_theirs),
        "the survey itself is another": lambda: forge(path, "rows/survey.zst", of_theirs),
        "more rows than are told": lambda: forge(path, "rows/coverage.zst", twice),
        "no rows but bytes": lambda: forge(path, "rows/axis_vertex.zst", lambda rows: b"\xff" * len(rows)),
        "a row that ends too early": lambda: forge(path, "rows/section.zst", lambda rows: rows[: len(rows) // 2]),
        "a bomb": lambda: forge(path, "rows/segment.zst", bomb(1 << 28), told=False),
        "a window without end": lambda: forge(path, "rows/segment.zst", lambda rows: rows, window),
    }
    tables = "SELECT tablename FROM pg_tables WHERE schemaname IN ('tunnel', 'tunnel_audit') ORDER BY 1"

    def state() -> list[tuple[object, ...]]:
        names = [name for (name,) in conn.execute(tables).fetchall()]
        rows = conn.execute("SELECT count(*), sum(xmin::text::bigint) FROM tunnel.survey").fetchall()
        rows += conn.execute("SELECT count(*), sum(xmin::text::bigint) FROM tunnel.finding").fetchall()
        conn.rollback()
        return [tuple(names), *rows]

    before, held = state(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for what, make in forged.items():
        file = make()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        result = CliRunner().invoke(main, ["survey", "import", str(file), "--name", "forged"])
        assert result.exit_code == 2, (what, result.output, result.exception)
        (line,) = result.stderr.splitlines()
        assert line.startswith(f"tunneldb: {file}: "), (what, line)
        assert "Nothing was imported" in line, what
        assert state() == before, what
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - max(peak, held) < 200_000, what  # kB
    assert CliRunner().invoke(main, ["survey", "import", str(path), "--name", "forged"]).exit_code == 0
