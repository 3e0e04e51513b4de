"""A damaged file among good ones."""

from __future__ import annotations

import shutil
from pathlib import Path

from faults.conftest import Survey
from faults.project import NAME, batch, differences, state


def test_bad_file_fails_its_kilometres_alone(survey: Survey, tmp_path: Path) -> None:
    """What rests on it fails with a line that says so, the rest is done; put right, all is as if it had always been."""
    survey.project.fresh()
    files = [Path(shutil.copy2(path, tmp_path)) for path in survey.files]
    bad = tmp_path / "part-03.laz"
    whole = bad.read_bytes()
    bad.write_bytes(whole[: len(whole) // 2])

    said = survey.project.run(*batch(files), code=1)
    assert "Traceback" not in said
    with survey.project.connect() as conn:
        done = conn.execute(
            "SELECT km FROM tunnel_internal.queue_state(1) GROUP BY km HAVING every(state = 'done') ORDER BY km"
        )
        assert [row[0] for row in done.fetchall()] == [0, 1, 2]
        failed = conn.execute(
            "SELECT km, message FROM tunnel_internal.queue_state(1) WHERE state = 'failed' ORDER BY km"
        ).fetchall()
        # By its box, whose ends are known to some 30 m: of kilometre 4 it holds 25 m.
        assert {3} <= {km for km, _ in failed} <= {3, 4}
        assert all("part-03.laz" in message and "\n" not in message for _, message in failed)
    status = survey.project.run("status", NAME, code=None)
    row = [line for line in status.splitlines() if line.startswith(("3 ", "3–4 "))]
    assert len(row) == 1, status
    assert "failed" in row[0], status
    assert "load: part-03.laz: " in row[0], status

    bad.write_bytes(whole)
    survey.project.run("batch", NAME, "--retry-failed", "--workers", 2)
    assert differences(survey.undisturbed, state(survey.project)) == []


def test_comparison_sees_what_is_lost_or_doubled(survey: Survey) -> None:
    """Otherwise nothing here could fail."""
    good = survey.undisturbed
    leak = (*good["finding"][0][:6], good["finding"][0][6] * 1.0001, *good["finding"][0][7:])
    moved = good["point"].copy()
    moved["segment"][7] += 1
    for name, rows in {
        "point": good["point"][1:],
        "finding": [leak, *good["finding"][1:]],
        "image": [(*good["image"][0][:3], good["image"][0][3] + b"\0"), *good["image"][1:]],
        "tables": [*good["tables"], ("fragment_s1_f1_km1",)],
    }.items():
        assert [text.split(":")[0] for text in differences(good, good | {name: rows})] == [name]
    assert "segment of 1 of" in differences(good, good | {"point": moved})[0]
