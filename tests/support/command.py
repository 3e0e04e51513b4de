"""Run a command of tunneldb within the test's process."""

from __future__ import annotations

from click.testing import CliRunner, Result

from tunneldb.cli.main import main


def command(*words: object, code: int = 0) -> Result:
    """Return the result of a command, which must end with the exit code."""
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert result.exit_code == code, (result.output, result.exception)
    return result


def output_of(*words: object, code: int = 0) -> str:
    """Return what a command prints, on both streams."""
    return command(*words, code=code).output


def errors_of(*words: object, code: int = 0) -> str:
    """Return what a command prints on standard error: one line if it is refused."""
    result = command(*words, code=code)
    if code:
        assert result.stderr.count("\n") == 1, result.stderr
        assert "Traceback" not in result.output
    return result.stderr


def refused(*words: object) -> str:
    """Return what a command prints that refuses its words or its input."""
    output = output_of(*words, code=2)
    assert "Traceback" not in output
    return output.strip()
