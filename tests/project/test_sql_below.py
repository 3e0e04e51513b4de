"""Commands know no SQL: it is in store/, queue/ and what lies below."""

from __future__ import annotations

from pathlib import Path

import tunneldb

CLI = Path(tunneldb.__file__).parent / "cli"


def test_no_command_executes_sql() -> None:
    assert [path.name for path in CLI.glob("*.py") if ".execute(" in path.read_text("utf-8")] == []
