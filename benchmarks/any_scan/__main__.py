"""Run the matrix.

    python -m benchmarks.any_scan                                  # all scenes, about 25 minutes on two cores
    python -m benchmarks.any_scan --only d5 profiles-0.5           # some of them
    python -m benchmarks.any_scan --table docs/real-scans.md       # the page, from the JSON of the last runs; runs nothing

Scans are made by a generator of its own, which shares no code with ``tunneldb simulate``: reflection, noise and shapes too.
Each is taken through ``tunnel add``, ``survey add``, ``load``, ``run``, ``leaks`` and ``report`` on one server.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path

from benchmarks.any_scan.galleries import GALLERIES
from benchmarks.any_scan.judge import judge
from benchmarks.any_scan.page import page
from benchmarks.any_scan.program import Program
from benchmarks.any_scan.scenes import SCENES as FIRST
from benchmarks.any_scan.stated import STATED
from benchmarks.common import RESULTS, print_table, progress

SCENES = (*FIRST, *STATED, *GALLERIES)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.any_scan", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", help="only these scenes")
    parser.add_argument(
        "--json", type=Path, default=RESULTS / "any_scan.json", metavar="FILE", help="verdicts, kept from run to run"
    )
    parser.add_argument("--table", type=Path, metavar="FILE", help="write the page from the JSON, and run nothing")
    parser.add_argument("--folder", type=Path, help="keep files and server here")
    arguments = parser.parse_args()
    if arguments.table:
        arguments.table.write_text(page(json.loads(arguments.json.read_text()), [scene.name for scene in SCENES]))
        return
    known = {scene.name: scene for scene in SCENES}
    unknown = set(arguments.only or ()) - set(known)
    if unknown:
        parser.error(f"no such scene: {', '.join(sorted(unknown))}")
    scenes = [known[name] for name in arguments.only] if arguments.only else SCENES
    verdicts = json.loads(arguments.json.read_text()) if arguments.json.exists() and arguments.only else {}
    place = nullcontext(arguments.folder) if arguments.folder else tempfile.TemporaryDirectory(prefix="any-scan-")
    arguments.json.parent.mkdir(exist_ok=True)
    with place as folder:
        root = Path(folder)
        root.mkdir(parents=True, exist_ok=True)
        program = Program(root / "home")
        program(root, "init")
        try:
            for scene in scenes:
                here = root / scene.name
                shutil.rmtree(here, ignore_errors=True)
                program(root, "survey", "remove", scene.name, "--yes")
                program(root, "tunnel", "remove", scene.name)
                verdict, calls = judge(scene, here, program)
                log = "\n".join(f"$ {call.line}   [{call.code}, {call.seconds:.1f} s]\n{call.text}" for call in calls)
                (here / "log.txt").write_text(log)
                verdicts[scene.name] = asdict(verdict)
                arguments.json.write_text(json.dumps(verdicts, indent=1, ensure_ascii=False) + "\n")
                said = "; ".join(verdict.faults) or verdict.said
                mark = "right" if verdict.right else "WRONG"
                progress(f"{mark} {scene.name} ({verdict.seconds:.0f} s): {verdict.seen}; {said}")
                for path in here.glob("*.la[sz]"):
                    path.unlink()
        finally:
            program(root, "server", "stop")
            program.close()
    rows = [[v["name"], v["expect"], v["seen"], f"{v['found']}/{v['true']}", v["false"], "yes" if v["right"] else "NO"]
            for v in verdicts.values()]  # fmt: skip
    print_table("any scan", ["scene", "expected", "seen", "found", "false", "right"], rows)


if __name__ == "__main__":
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    main()
