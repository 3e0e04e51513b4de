"""A process that has the program's libraries loaded, and forks one of its own for each command.

Asked by lines of JSON: ``{"folder": …, "words": […]}``; answers ``{"code": …, "out": …, "err": …}``.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import signal
import sys
import tempfile
import traceback
from pathlib import Path

CPU_LIMIT, LIMIT = 300, 3600
"""s of the processor, and s; a command that isn't over by then is ended by a signal."""
LIBRARIES = (
    "laspy",
    "matplotlib.figure",
    "numba",
    "psycopg",
    "pyproj",
    "rasterio",
    "rich.table",
    "scipy.ndimage",
    "scipy.optimize",
    "scipy.spatial",
    "shapely",
    "sqlalchemy",
    "tunneldb.cli.main",
)


def serve() -> None:
    for name in LIBRARIES:
        importlib.import_module(name)
    for line in sys.stdin:
        asked = json.loads(line)
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            child = os.fork()
            if child == 0:
                _verb(Path(asked["folder"]), asked["words"], out.fileno(), err.fileno())
            _, status = os.waitpid(child, 0)
            texts = []
            for stream in (out, err):
                stream.seek(0)
                texts.append(stream.read().decode(errors="replace"))
        print(json.dumps({"code": os.waitstatus_to_exitcode(status), "out": texts[0], "err": texts[1]}), flush=True)


def _verb(folder: Path, words: list[str], out: int, err: int) -> None:
    """Be the program; never returns."""
    code = 1
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT, CPU_LIMIT))
        signal.alarm(LIMIT)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(err, 2)
        os.chdir(folder)
        sys.argv = ["tunneldb", *words]
        sys.modules["__main__"].__package__ = ""  # else the program takes its name from this module
        from tunneldb.cli.main import main

        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    serve()
