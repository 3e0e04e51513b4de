"""A survey's state on the terminal: the table of kilometres and stages, and what to type where something is wrong."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from rich.console import Console, ConsoleOptions, Group, JustifyMethod, RenderableType, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from tunneldb.cli.output import printable
from tunneldb.queue.causes import cause_of
from tunneldb.queue.progress import TO_DO, Cell, File, Overview, Worker
from tunneldb.stages.registry import STAGE_NAMES

STYLES = {
    "done": "green",
    "running": "cyan",
    "queued": "blue",
    "waits": "dim",
    "failed": "bold red",
    "interrupted": "red",
    "stale": "yellow",
    "never": "dim",
    "empty": "dim",
}

_STATE_TEXTS = {"failed": "failed", "interrupted": "was cut off", "stale": "out of date", "never": "not yet run"}


@dataclass(frozen=True)
class Advice:
    """Something that does not get done by itself: where, what is wrong, what to type, and what has to be done before."""

    kilometres: tuple[int, ...]
    what: str
    command: str
    first: str = ""

    def line(self) -> str:
        """All of it in one line."""
        where = f"km {spans(self.kilometres)}: " if self.kilometres else ""
        return f"{where}{self.what}: {f'first {self.first}, then: ' if self.first else ''}{self.command}"


def render(seen: Overview) -> RenderableType:
    """Return all there is to see of a survey: for a terminal of 80 columns or more, or for a pipe."""
    parts: list[RenderableType] = [_kilometres(seen)] if seen.kilometres else []
    parts += [text for text in (_files(seen.files), summary(seen)) if text]
    if seen.workers:
        parts.append(_workers(seen.workers, seen.survey))
    advices = advise(seen)
    if advices:
        parts.append(_to_do(advices))
    between = [item for part in parts for item in (Text(), part)]
    return Group(*between[1:])


def _kilometres(seen: Overview) -> FittedTable:
    """Return a row for each kilometre, or for several consecutive ones with equal content."""
    entries = [
        (km, tuple(cells[stage].state for stage in STAGE_NAMES), remark(km, seen)) for km, cells in seen.kilometres.items()
    ]
    rows = [
        [Text(spans([km for km, *_ in group])), *(Text(state, STYLES[state]) for state in states), Text(said)]
        for (states, said), group in ((key, list(group)) for key, group in groupby(entries, key=lambda entry: entry[1:]))
    ]
    return FittedTable(("km", *STAGE_NAMES, ""), rows, elastic=len(STAGE_NAMES) + 1)


@dataclass(frozen=True)
class FittedTable:
    """A table as wide as there is room for: only column ``elastic`` is cut; those of ``right`` are aligned to the right."""

    header: Sequence[str]
    rows: Sequence[Sequence[Text]]
    elastic: int
    right: Sequence[int] = ()

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        widths = [max([len(name), *(row[index].cell_len for row in self.rows)]) for index, name in enumerate(self.header)]
        others = sum(widths) - widths[self.elastic] + len(widths)
        widths[self.elastic] = max(min(widths[self.elastic], options.max_width - others), len(self.header[self.elastic]), 4)
        table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 1, 0, 0))
        for index, (name, width) in enumerate(zip(self.header, widths, strict=True)):
            justify: JustifyMethod = "right" if index in self.right else "left"
            table.add_column(name, no_wrap=True, overflow="ellipsis", width=width, justify=justify)
        for row in self.rows:
            table.add_row(*row)
        yield table


def remark(km: int, seen: Overview) -> str:
    """Return, in one line, what there is to say of the first stage of a kilometre that is not done."""
    for stage, cell in seen.kilometres[km].items():
        if cell.state == "running":
            where = f" on {cell.worker}" if cell.worker else ""
            since = f" for {duration((seen.now - cell.since).total_seconds())}" if cell.since else ""
            return f"{stage}{where}{since}"
        if cell.reason:
            return f"{stage}: {_line(cell, seen.files)}"
    return ""


def _line(cell: Cell, files: Sequence[File]) -> str:
    """Return the first line of a reason, with files named without their folders."""
    text = (cell.reason or "").splitlines()[0]
    for file in files:
        text = text.replace(file.path, file.name)
    return printable(text)


def _files(files: Sequence[File]) -> Text | None:
    if not files:
        return None
    said = []
    running = [file.name for file in files if file.state == "running"]
    waiting = [file.name for file in files if file.state == "waiting"]
    failed = [file.name for file in files if file.state == "failed"]
    if running:
        said.append(f"being read: {', '.join(running)}")
    if waiting:
        said.append(f"{len(waiting)} wait to be read: {_first_and_last(waiting)}")
    if failed:
        said.append(f"{len(failed)} failed: {_first_and_last(failed)}")
    return Text(printable("files: " + "; ".join(said)))


def _first_and_last(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{names[0]} … {names[-1]}"


def summary(seen: Overview) -> Text | None:
    """Return in one line how much is done, how fast it goes and how long it will take."""
    if not seen.total:
        return None
    steps = f"{seen.done} of {seen.total} steps done"
    if not seen.active:
        return Text(steps)
    share = f"{seen.share:.0%} of the work done, {steps}" if seen.share is not None else steps
    rate = f"{number(seen.rate)} points/s" if seen.rate is not None else "— points/s"
    workers = f"{seen.live} worker{'s' * (seen.live != 1)}"
    left = f"{duration(seen.left)} left" if seen.left is not None else "time left —"
    return Text(f"{share}; {rate}; {left} with {workers}")


def _workers(workers: Iterable[Worker], survey: str) -> FittedTable:
    rows = [
        [
            Text(worker.host),
            Text(str(worker.pid)),
            Text((worker.doing or "idle").replace(f" of {survey}", "")),
            Text(duration(worker.busy) if worker.busy is not None else ""),
            Text(f"{duration(worker.silent)} ago", "red" if worker.lost else ""),
            Text("lost", "red") if worker.lost else Text("stopping" if worker.stopping else ""),
        ]
        for worker in workers
    ]
    return FittedTable(("worker", "pid", "doing", "for", "heartbeat", ""), rows, elastic=0, right=(1,))


def _to_do(advices: Iterable[Advice]) -> Group:
    lines: list[RenderableType] = [Text("what to do", "bold")]
    for advice in advices:
        where = f"km {spans(advice.kilometres)}: " if advice.kilometres else ""
        lines.append(Text(f"{where}{advice.what}"))
        if advice.first:
            lines.append(Padding(Text(f"first {advice.first}, then"), (0, 0, 0, 4), expand=False))
        lines.append(Padding(Text(advice.command, "cyan"), (0, 0, 0, 4), expand=False))
    return Group(*lines)


def advise(seen: Overview) -> list[Advice]:
    """Return problems that need a command, each with that command and what it does not fix."""
    found: dict[tuple[str, str, str], list[int]] = {}
    for file in seen.files:
        if file.state == "failed":
            what = _line(Cell("failed", file.message or f"{file.path} could not be read"), seen.files)
            command = f"tunneldb batch {seen.survey} {shlex.quote(file.path)}"
            key = (
                what if file.name in what else f"{printable(file.name)}: {what}",
                printable(command),
                cause_of(file.message, [file.path]).first,
            )
            found[key] = _range(file)
    read = {file.message for file in seen.files}
    for km, cells in seen.kilometres.items():
        last = STAGE_NAMES.index(seen.targets.get(km, STAGE_NAMES[-1]))
        wanted = [(stage, cells[stage]) for stage in STAGE_NAMES[: last + 1]]
        entry = next(((stage, cell) for stage, cell in wanted if cell.state not in ("done", "empty", *TO_DO)), None)
        if entry is None or (entry[1].state == "failed" and entry[1].reason in read):
            continue
        stage, cell = entry
        what = f"{stage}: {_STATE_TEXTS[cell.state]}" + (f": {_line(cell, seen.files)}" if cell.reason else "")
        first = cause_of(cell.reason, [file.path for file in seen.files]).first if cell.state == "failed" else ""
        found.setdefault((what, _command(seen.survey, cell), first), []).append(km)
    advices = [Advice(tuple(kms), what, command, first) for (what, command, first), kms in found.items()]
    if seen.active and not seen.live:
        advices.insert(0, Advice((), "no worker serves the queue", "tunneldb worker"))
    return advices


def _range(file: File) -> list[int]:
    return [] if file.km_from is None or file.km_to is None else list(range(file.km_from, file.km_to + 1))


def _command(survey: str, cell: Cell) -> str:
    return f"tunneldb batch {survey}" + (" --retry-failed" if cell.state == "failed" else "")


def spans(kilometres: Sequence[int]) -> str:
    """Return sorted kilometres as ranges: ``0–11, 13``."""
    parts: list[str] = []
    for _, group in groupby(enumerate(kilometres), key=lambda pair: pair[1] - pair[0]):
        run = [km for _, km in group]
        parts.append(f"{run[0]}–{run[-1]}" if len(run) > 1 else str(run[0]))
    return ", ".join(parts)


def duration(seconds: float) -> str:
    """Return a time in its two greatest units: ``12 s``, ``3 min``, ``1 h 12 min``, ``2 d 3 h``."""
    seconds = max(seconds, 0.0)
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    if minutes < 60:
        return f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    if hours < 48:
        return f"{hours} h {minutes} min"
    return f"{hours // 24} d {hours % 24} h"


def number(value: float) -> str:
    """Return a number with spaces between thousands."""
    return f"{value:,.0f}".replace(",", " ")
