"""Log of a command: one JSON object per line in a file, and text on standard error.

Log with ``logging.getLogger(__name__)``. Values that programs are to read go into ``extra=fields(km=3)``.
"""

from __future__ import annotations

import datetime as dt
import json
import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tunneldb.errors import InputError

VARIABLE = "TUNNELDB_LOG"
"""Environment variable that names the log file; workers inherit it."""

MESSAGES = "tunneldb.messages"
"""Logger of the messages that a command prints on standard error."""

WAITS = "tunneldb.waits"
"""Logger of lines about other sessions that the program waits for; commands print them on standard error."""


class JsonFormatter(logging.Formatter):
    """Formatter that writes a record as one line of JSON."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record with its fields, and with the traceback if it has one."""
        entry = {
            "time": dt.datetime.fromtimestamp(record.created, dt.UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname,
            "logger": record.name,
            "process": record.process,
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            entry["traceback"] = self.formatException(record.exc_info)
        return json.dumps(entry, ensure_ascii=False, default=str)


def fields(**values: Any) -> dict[str, Any]:
    """Return values for the argument ``extra`` of a logging call; each becomes a key of the JSON object."""
    return {"fields": values}


@contextmanager
def logging_to(path: Path | None, verbosity: int = 0) -> Iterator[None]:
    """Log inside a with block; libraries' log records and warnings go to the log only, never to standard error by themselves.

    Parameters
    ----------
    path : Path or None
        File to append to; None for no file. Processes that are started inside find it in TUNNELDB_LOG.
    verbosity : int
        0 for nothing on standard error, 1 for progress messages, 2 also for tracebacks of all errors.

    Raises
    ------
    InputError
        If the file cannot be opened.
    """
    handlers: list[logging.Handler] = [logging.NullHandler()]  # without a handler, Python prints warnings of libraries
    if path is not None:
        try:
            file = logging.FileHandler(path, encoding="utf-8", errors="backslashreplace")
        except OSError as error:
            raise InputError(f"{path}: the log cannot be written: {error.strerror}") from error
        file.setFormatter(JsonFormatter())
        handlers.append(file)
    if verbosity:
        handlers.append(_on_stderr(verbosity))
    root, ours = logging.getLogger(), logging.getLogger("tunneldb")
    level, inherited = ours.level, os.environ.get(VARIABLE)
    ours.setLevel(logging.INFO if path is not None or verbosity else level)
    if path is not None:
        os.environ[VARIABLE] = str(path.absolute())
    for handler in handlers:
        root.addHandler(handler)
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for handler in handlers:
            root.removeHandler(handler)
            handler.close()
        ours.setLevel(level)
        if path is not None:
            os.environ.pop(VARIABLE)
            if inherited is not None:
                os.environ[VARIABLE] = inherited


class _TextFormatter(logging.Formatter):
    def __init__(self, tracebacks: bool) -> None:
        super().__init__("%(asctime)s %(levelname)s %(message)s", "%H:%M:%S")
        self.tracebacks = tracebacks

    def formatException(self, ei: Any) -> str:  # noqa: N802 - of logging
        return super().formatException(ei) if self.tracebacks else ""


def _on_stderr(verbosity: int) -> logging.Handler:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_TextFormatter(verbosity > 1))
    # Messages that are printed anyway are not repeated, except for their tracebacks.
    handler.addFilter(lambda record: record.name != MESSAGES or (verbosity > 1 and record.exc_info is not None))
    return handler
