"""Programs in benchmarks/, which is no part of the installed package, as modules."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

FOLDER = Path(__file__).parents[2] / "benchmarks"


def load_benchmark(path: str) -> ModuleType:
    """Return the module of a file in benchmarks/, such as ``evidence/fit.py``."""
    spec = importlib.util.spec_from_file_location("benchmark_" + path.removesuffix(".py").replace("/", "_"), FOLDER / path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # data classes look their module up
    spec.loader.exec_module(module)
    return module
