"""Output of `tunneldb batch --preview`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console, Group, RenderableType
from rich.text import Text

from tunneldb.cli.overview import FittedTable, duration, number, spans
from tunneldb.queue.batch import Incoming
from tunneldb.queue.preview import Preview, Span, kilometres_of


def show(seen: Preview) -> None:
    """Print a preview."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=1000)  # a pipe has no width: let nothing be cut there
    parts: list[RenderableType] = []
    for part in (_files(seen), _kilometres(seen), _points(seen), _disk(seen), _time(seen), _problems(seen)):
        parts += [Text(), *part] if parts and part else part
    console.print(Group(*parts))


def _files(seen: Preview) -> list[RenderableType]:
    rows = [
        [
            Text(file.name),
            Text(number(file.points) if file.points else ""),
            Text(size(file.bytes)),
            Text(spans(_kilometres_of(file, seen))),
            Text("can't be read, see below", "bold red")
            if file.error
            else Text("read already" if file.already_read else "", "green"),
        ]
        for file in seen.plan.files
    ]
    return [FittedTable(("file", "points", "size", "km", ""), rows, elastic=0, right=(1, 2))] if rows else []


def _kilometres_of(file: Incoming, seen: Preview) -> Sequence[int]:
    if file.name in seen.stretches:
        return kilometres_of(seen.stretches[file.name])
    return file.touched


def _kilometres(seen: Preview) -> list[RenderableType]:
    lines = []
    if seen.covered:
        lines.append(Text(f"kilometres covered: {spans(seen.covered)}"))
    if seen.missing:
        lines.append(Text(f"kilometres missing: {spans(seen.missing)}", "bold yellow"))
    lines += [Text(f"no file from about {low:.0f} to {high:.0f} m", "yellow") for low, high in seen.gaps]
    lines.append(Text(f"kilometres to be worked at: {spans(seen.plan.kilometres) or 'none'}"))
    return list(lines)


def _points(seen: Preview) -> list[RenderableType]:
    if not seen.points:
        return []
    rows = f"about {_rounded(seen.rows.likely)} rows ({_rounded(seen.rows.low)} to {_rounded(seen.rows.high)})"
    return [Text(f"points to be read: {number(seen.points)}, of these {rows}, estimated from a sample")]


def _rounded(value: float) -> str:
    """Return a number to two digits: an estimate has no more."""
    return number(float(f"{value:.1e}"))


def _disk(seen: Preview) -> list[RenderableType]:
    disk = seen.disk
    need = (
        f"disk needed: about {size(disk.total)} ({size(seen.need.low)} to {size(seen.need.high)}; points {size(disk.points)},"
        f" in passing {size(disk.passing)}, images {size(disk.images)}, others {size(disk.others)}, write-ahead log"
        f" {size(disk.wal)})"
    )
    low, high = seen.temporary.low, seen.temporary.high
    temporary = f"temporary folder of the workers (TMPDIR): {size(low)} to {size(high)}"
    lines = [Text(need)]
    if seen.free is None:
        lines.append(Text("disk free: can't be seen from here; ask who runs the server"))
    else:
        lines.append(_free(seen.free, str(seen.folder), seen.need))
    return [*lines, Text(temporary), _free(seen.temporary_free, str(seen.temporary_folder), seen.temporary)]


def _free(free: int, folder: str, need: Span) -> Text:
    text = f"disk free: {size(free)} in {folder}"
    if need.high <= free:
        return Text(text, "green")
    return Text(f"{text}: {'TOO LITTLE' if need.likely > free else 'perhaps TOO LITTLE'}", "bold red")


def _time(seen: Preview) -> list[RenderableType]:
    workers = f"{seen.workers} worker{'s' * (seen.workers != 1)}"
    if seen.seconds is None:
        lines = [Text("time: unknown until a kilometre was done in this database")]
    else:
        most = "about" if all(not file.already_read for file in seen.plan.files) and seen.plan.files else "at most"
        lines = [Text(f"time: {most} {duration(seen.seconds)} with {workers}, by what was measured in this database")]
    said = [
        f"read {number(1.0 / speed.seconds)} points/s"
        if speed.stage == "read"
        else f"{speed.stage} {duration(speed.seconds)} a km"
        for speed in seen.speeds
        if speed.seconds > 0.0
    ]
    return [*lines, Text(f"measured, a worker: {', '.join(said)}")] if said else list(lines)


def _problems(seen: Preview) -> list[RenderableType]:
    lines: list[RenderableType] = [Text(text) for text in _lines(seen)]
    return [Text("problems", "bold"), *lines] if lines else []


def _lines(seen: Preview) -> Iterator[str]:
    for file in seen.plan.files:
        if file.error:
            yield file.error
    if seen.plan.skipped:
        yield f"not read, outside the kilometres of --km by header and sample: {', '.join(seen.plan.skipped)}"
    if not seen.fits:
        yield "a disk is too small: free some, take fewer kilometres at a time (--km), or a lower --density; or set TMPDIR"


def size(count: float) -> str:
    """Return a number of bytes in its unit: ``12 MB``, ``3.4 GB``."""
    for unit, factor in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if count >= factor:
            return f"{count / factor:.1f} {unit}" if count < 100 * factor else f"{count / factor:.0f} {unit}"
    return f"{count / 1e3:.0f} kB"
