"""What is compiled is kept in, and run from, no folder that others may write to."""

from __future__ import annotations

from pathlib import Path

import pytest

from tunneldb.compiled_cache import require_own_cache
from tunneldb.errors import UserError


@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o707])
def test_a_folder_that_others_may_write_to_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    cache.chmod(mode)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(cache))
    with pytest.raises(UserError, match=r"NUMBA_CACHE_DIR .* can be written to by other users"):
        require_own_cache()
    cache.chmod(0o700)
    require_own_cache()


def test_so_is_one_below_such_a_folder_and_the_default_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    require_own_cache()  # none yet
    (tmp_path / ".cache" / "numba").mkdir(parents=True)
    require_own_cache()
    (tmp_path / ".cache").chmod(0o777)
    with pytest.raises(UserError, match=r"\.cache can be written to by other users.* set NUMBA_CACHE_DIR"):
        require_own_cache()
