"""Run a command of tunneldb within the test's process."""

from __future__ import annotations

from click.testing import CliRunner, Result

from tunneldb.cli.main import main


def command(*words: object, code: int = 0) -> Result:
    """Return the result of a command, which must end with the exit code."""
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert result.exit_code == code, (result.output, result.exception)
    return result
