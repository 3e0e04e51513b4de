"""A survey of 500 anomalies reviewed in QGIS Desktop, by the dock of the plugin and by the attribute form, with mouse and keys.

    python -m benchmarks.review_dock                        # simulates and detects a tunnel first: some minutes
    python -m benchmarks.review_dock --folder DIR           # keeps all there, and begins with what is there
    python -m benchmarks.review_dock --folder DIR --pictures docs/images

The packaged zip is installed into a fresh profile; a person who is nothing but inspector opens the project and the dock,
connects, steps, filters, and gives each anomaly its verdict, some a kind and a remark, by key. After each verdict it is waited
until the database has it and the next finding's three pictures are there; the first times, until the map is drawn, too. As
many are first reviewed in the form view of the layer's attribute table, which pans the map, each saved; there the next is
shown when its form is there, but only the map has pictures. Verdicts, kinds, remarks and names of all are
compared with what was meant; what is not as it should be is printed, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median, quantiles

import psycopg
from PIL import Image
from psycopg.conninfo import conninfo_to_dict

from benchmarks import desk
from benchmarks.common import print_table, progress, save, tunneldb
from benchmarks.desktop import Eyes, Hands, desktop, screen, until
from benchmarks.review_survey import COUNT, SURVEY, reopen, repeat
from tunneldb.database import connect, resolve_dsn

LAYER = "finding_area_unrolled"
BY_FORM = 30
"""Anomalies that are reviewed in the form, by default."""

PICTURED = 1
"""Place in the dock's order of the one that is pictured: a large leak."""

WIDEST = 1200
"""Width to which larger pictures are reduced, pixels."""

KINDS = {"6": "efflorescence", "d": "dark", "j": "joint"}
"""Keys of kinds, and what they mean."""


@dataclass(frozen=True)
class Verdict:
    """What is said of a finding."""

    review: str
    kind: str | None = None
    remark: str | None = None


@dataclass
class Measured:
    """What each review took: seconds until it was written and the next one shown, seconds of QGIS's processor, keys, clicks.

    ``drawn`` has the seconds until the map was drawn, too, of those at which it was waited for.
    """

    shown: list[float] = field(default_factory=list)
    drawn: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    keys: list[int] = field(default_factory=list)
    clicks: list[int] = field(default_factory=list)


def meant(finding: int) -> Verdict:
    """Return the intended review of a finding: every third rejected, every tenth with a kind, every 25th with a remark."""
    kind = list(KINDS.values())[finding // 10 % len(KINDS)] if finding % 10 == 0 else None
    return Verdict(
        "rejected" if finding % 3 == 0 else "confirmed", kind, f"no. {finding}: look again" if finding % 25 == 0 else None
    )


def prepare(folder: Path, rest: bool) -> str:
    """Make survey, inspector, project and zip, and take reviews away unless the rest is to be reviewed; the owner's DSN."""
    desk.prepare(folder)
    dsn = resolve_dsn(None)
    theirs = conninfo_to_dict(dsn) | {"user": desk.INSPECTOR}
    (folder / "pg_service.conf").write_text("\n".join(["[review]", *(f"{k}={v}" for k, v in theirs.items()), ""]))
    with connect(dsn) as conn:
        if not rest:
            reopen(conn)
            made = repeat(conn)
            if made != COUNT:
                raise SystemExit(f"{made} anomalies could be made, not {COUNT}")
    if not (folder / "review.qgz").exists():
        progress("writes the project")
        tunneldb("qgis", SURVEY, "-o", folder / "review.qgz", "--service", "review")
    shutil.rmtree(folder / "profile", ignore_errors=True)
    subprocess.run([sys.executable, "scripts/package_plugin.py", str(folder)], check=True, stdout=subprocess.DEVNULL)
    return dsn


class Review:
    """The inspector at QGIS.

    Parameters
    ----------
    hands, eyes
    conn : psycopg.Connection
        The owner's, with autocommit.
    folder : Path
    pictures : Path or None
        Where pictures of the manual go.
    waits : int
        At how many reviews by the dock it is waited for the map, too.
    """

    def __init__(
        self, hands: Hands, eyes: Eyes, conn: psycopg.Connection, folder: Path, pictures: Path | None, waits: int
    ) -> None:
        self.hands, self.eyes, self.conn, self.folder, self.pictures = hands, eyes, conn, folder, pictures
        self.waits = waits
        self.wrong: list[str] = []

    def open_project(self) -> None:
        """Install the plugin, and open the project by keys."""
        self.eyes.ask("tidy")
        self.drawn()
        (archive,) = self.folder.glob("tunneldb_review-*.zip")
        if not self.eyes.ask("install", str(archive)):
            raise SystemExit("the plugin's zip cannot be installed")
        self.hands.press("ctrl+o")
        self.eyes.until("the dialogue", lambda seen: seen["focus"] == "fileNameEdit")
        # The list of names that fit takes Return for itself when it has opened by then, and what is chosen is its folder.
        self.hands.type(f"{self.folder}/")
        self.hands.press("Return")
        self.eyes.until("the folder", lambda seen: seen["text"] == "")
        self.hands.type("review.qgz")
        self.eyes.until("the name", lambda seen: seen["text"] == "review.qgz")
        self.hands.press("Return")
        self.eyes.until("the project", lambda seen: seen["project"] and not seen["modal"])
        self.eyes.ask("tidy")
        self.eyes.ask("theme", "Unrolled")
        self.drawn()

    def drawn(self) -> None:
        """Wait until no canvas is being drawn, twice: a canvas begins a little after it was told to."""
        calm = 0
        while calm < 3:
            calm = 0 if self.eyes.ask("state")["drawing"] else calm + 1
            time.sleep(0.01)

    def written(self, finding: int, verdict: Verdict) -> None:
        """Wait until the database has a verdict."""
        until(
            f"{verdict} of {finding}",
            lambda: (
                self.conn.execute("SELECT review FROM tunnel.finding WHERE id = %s", [finding]).fetchone() == (verdict.review,)
            ),
        )

    def by_form(self, count: int) -> Measured:
        """Review some in the form view of the attribute table."""
        hands, eyes = self.hands, self.eyes
        hands.click(eyes.place("layer", LAYER))
        hands.press("F6")
        hands.click(eyes.place("widget", "Toggle editing mode"))
        until("editing", lambda: eyes.ask("edits", LAYER)["editable"])
        hands.click(eyes.place("widget", "Form View"))
        hands.click(eyes.place("widget", "mAutoPanButton", True))
        following = eyes.place("widget", "mNextFeatureButton", True)
        order = [
            id for (id,) in self.conn.execute("SELECT id FROM tunnel.finding ORDER BY id::text LIMIT %s", [count]).fetchall()
        ]
        measured = Measured()
        self.drawn()
        eyes.ask("grab", str(self.folder / "form.png"))
        for finding in order:
            start, before = time.perf_counter(), hands.events
            verdict = meant(finding)
            hands.click(eyes.place("widget", "review"))
            eyes.until("the list", lambda seen: seen["popup"])
            # by arrows: letters that follow each other within 0.4 s are one word to a list
            hands.press(*["Down"] * (1 + ("confirmed", "rejected").index(verdict.review)), "Return")
            eyes.until("the list closed", lambda seen: not seen["popup"])
            hands.click(following)  # with that the form writes into the layer
            until("the edit", lambda: eyes.ask("edits", LAYER)["modified"])
            hands.click(eyes.place("widget", "Save edits"))
            self.written(finding, verdict)
            self._took(measured, start, before)
            self.drawn()
            measured.drawn.append(time.perf_counter() - start)
        eyes.ask("grab", str(self.folder / "form-end.png"))
        hands.click(eyes.place("widget", "Toggle editing mode"))
        hands.press("alt+F4")
        eyes.until("the table closed", lambda seen: "Findings" not in (seen["window"] or ""))
        rows = dict(self.conn.execute("SELECT id, review FROM tunnel.finding WHERE id = ANY (%s)", [order]).fetchall())
        self.wrong += [f"form: {id} is {rows[id]}" for id in order if rows[id] != meant(id).review]
        return measured

    def open_dock(self) -> None:
        """Connect in the dialogue, and open the dock."""
        hands, eyes = self.hands, self.eyes
        (surveys,) = self.conn.execute("SELECT count(*) FROM tunnel_api.survey").fetchone()  # type: ignore[misc]
        for entry in ("Database", "tunneldb", "Connect…"):
            hands.click(eyes.place("menu", entry))
        eyes.until("the dialogue", lambda seen: seen["modal"] == "Connect to tunneldb")
        hands.click(eyes.place("widget", "Try it"))
        eyes.place("widget", f"Connected as {desk.INSPECTOR}: {surveys} surveys.")
        self.picture("plugin-connect", "Connect to tunneldb")
        hands.click(eyes.place("widget", "OK"))
        eyes.until("the dock", lambda seen: seen.get("dock") and seen["settled"] and seen["pictures"] == 3)
        hands.press("ctrl+alt+l")
        eyes.until("keys in the dock", lambda seen: seen["keys"])

    def step_and_filter(self) -> None:
        """Step to and fro, ask for the large ones alone, and for all again, the largest first."""
        hands, eyes = self.hands, self.eyes
        first = eyes.ask("state")["current"]
        hands.press("n")
        second = eyes.until("the next", lambda seen: seen["current"] != first and seen["settled"])["current"]
        hands.press("p")
        eyes.until("the one before", lambda seen: seen["current"] == first and seen["settled"])
        hands.press("Right", "Left")
        eyes.until("to and fro", lambda seen: seen["current"] == first and seen["settled"])
        self.check(second == eyes.ask("order")[1], f"after {first} came {second}")
        (large,) = self.conn.execute(  # type: ignore[misc]
            "SELECT count(*) FROM tunnel_api.finding WHERE survey = %s AND area >= 0.5", [SURVEY]
        ).fetchone()
        for text, wanted in (("0.5", large), ("0", COUNT)):
            hands.click(eyes.place("widget", "min_area"))
            hands.press("ctrl+a")
            hands.type(text)
            hands.press("Tab")
            eyes.until(f"{wanted} findings from {text} m²", lambda seen, wanted=wanted: seen["listed"] == wanted)
        hands.click(eyes.place("widget", "order"))
        eyes.until("the list", lambda seen: seen["popup"])
        hands.type("larg")
        hands.press("Return")
        largest = self.conn.execute(
            "SELECT id FROM tunnel_api.finding WHERE survey = %s ORDER BY area DESC LIMIT 1", [SURVEY]
        ).fetchone()
        eyes.until("the largest first", lambda seen: (seen["current"],) == largest and seen["settled"])
        eyes.until("keys in the dock again", lambda seen: seen["keys"])
        self.drawn()

    def by_dock(self, count: int) -> Measured:
        """Give each finding its verdict by keys, in the dock's order."""
        measured = Measured()
        order, before_all = self.eyes.ask("order"), self.eyes.ask("state")["reviewed"]
        for place, finding in enumerate(order[:count]):
            if before_all + place == PICTURED:
                self.picture("plugin-review")
            start, before, verdict = time.perf_counter(), self.hands.events, meant(finding)
            self.say(verdict)
            after = order[place + 1] if place + 1 < len(order) else finding
            self.eyes.until(
                f"{after}, the one after {finding}",
                lambda seen, after=after, done=before_all + place + 1: (
                    (seen["reviewed"], seen["current"], seen["settled"]) == (done, after, True)
                ),
            )
            self.written(finding, verdict)
            self._took(measured, start, before)
            if place < self.waits:
                self.drawn()
                measured.drawn.append(time.perf_counter() - start)
        self.eyes.ask("grab", str(self.folder / "dock-end.png"))
        return measured

    def say(self, verdict: Verdict) -> None:
        """Say a verdict by keys."""
        hands, eyes = self.hands, self.eyes
        if verdict.kind is not None:
            hands.press(next(key for key, kind in KINDS.items() if kind == verdict.kind))
        if verdict.remark is not None:
            hands.press("m")
            eyes.until("the remark's line", lambda seen: seen["focus"] == "remark")
            hands.type(verdict.remark)
            hands.press("Return")
            eyes.until("keys in the dock", lambda seen: seen["focus"] != "remark")
        hands.press(verdict.review[0])

    def picture(self, name: str, of: str = "") -> None:
        """Take a picture of the screen, or of a window on it, and keep it with few colours where pictures are wanted."""
        self.eyes.ask("grab", str(self.folder / f"{name}.png"))
        with Image.open(self.folder / f"{name}.png") as whole:
            x, y, width, height = self.eyes.ask("frame", of) if of else (0, 0, *whole.size)
            part = whole.convert("RGB").crop((x, y, x + width, y + height))
        if self.pictures is not None:
            part.thumbnail((WIDEST, WIDEST), Image.Resampling.LANCZOS)
            few = part.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)  # others lose the few red pixels
            few.save(self.pictures / f"{name}.png", optimize=True)

    def check_database(self, left: list[int]) -> None:
        """Compare all verdicts, kinds, remarks and names with what was meant, but those that are left, which must be open."""
        rows = self.conn.execute(
            "SELECT f.id, f.review, f.kind, f.kind_detected, f.remark, f.reviewed_by FROM tunnel_api.finding f"
            " WHERE f.survey = %s",
            [SURVEY],
        ).fetchall()
        for id, review, kind, found, remark, who in rows:
            wanted = Verdict("open") if id in left else meant(id)
            self.check(
                (review, kind, remark, who)
                == (wanted.review, wanted.kind or found, wanted.remark, None if id in left else desk.INSPECTOR),
                f"{id} is {(review, kind, remark, who)}, not {wanted}",
            )

    def check(self, right: bool, text: str) -> None:
        """Note what is wrong."""
        if not right:
            self.wrong.append(text)

    def _took(self, measured: Measured, start: float, before: tuple[int, int]) -> None:
        measured.shown.append(time.perf_counter() - start)
        measured.cpu.append(self.eyes.ask("cpu"))
        measured.keys.append(self.hands.keys - before[0])
        measured.clicks.append(self.hands.clicks - before[1])


def figures(name: str, measured: Measured) -> tuple[object, ...]:
    """A row of the table."""
    with_map = median(measured.drawn) if measured.drawn else "-"
    return (
        name, len(measured.shown), median(measured.shown), quantiles(measured.shown, n=20)[-1], with_map,
        (measured.cpu[-1] - measured.cpu[0]) / max(len(measured.cpu) - 1, 1),
        sum(measured.keys) / len(measured.keys), sum(measured.clicks) / len(measured.clicks),
    )  # fmt: skip


def run(folder: Path, pictures: Path | None, count: int, by_form: int, rest: bool) -> int:
    """All of it; the exit code."""
    os.environ["TUNNELDB_HOME"] = str(folder / "home")
    dsn = prepare(folder, rest)
    with (
        psycopg.connect(dsn, autocommit=True) as conn,
        screen() as display,
        desktop(folder, display, {"PGSERVICEFILE": str(folder / "pg_service.conf")}) as (hands, eyes),
    ):
        review = Review(hands, eyes, conn, folder, pictures, by_form)
        measured: dict[str, Measured] = {}
        try:
            progress("opens the project in QGIS Desktop")
            review.open_project()
            if by_form and not rest:
                progress(f"reviews {by_form} in the form")
                measured["form"] = review.by_form(by_form)
                reopen(conn)
            review.open_dock()
            if not rest:
                review.step_and_filter()
            progress(f"reviews {count} in the dock")
            measured["dock"] = review.by_dock(count)
            told, left = eyes.ask("state")["told"], eyes.ask("order")
            done = COUNT - len(left)
            review.check(told.startswith(f"{done} of {COUNT} reviewed"), f"the dock says: {told}")
        except Exception:
            eyes.ask("grab", str(folder / "failed.png"))
            raise
        review.check_database(left)
    header = ("way", "reviews", "s, median", "s, p95", "s with the map", "s of CPU", "keys", "clicks")
    print_table("Seconds and events of a review", header, [figures(name, each) for name, each in measured.items()])
    print(f"\nthe dock said at its end: {told}")
    print("\n".join(review.wrong) if review.wrong else f"all {done} verdicts, kinds, remarks and names are in the database")
    save("review_dock", {name: vars(each) for name, each in measured.items()} | {"told": told, "wrong": review.wrong})
    return 1 if review.wrong else 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, help="kept, and begun with what is there; default: a temporary one")
    parser.add_argument("--pictures", type=Path, help="folder for pictures; default: none are written")
    parser.add_argument("--count", type=int, default=COUNT, help="findings to review by the dock")
    parser.add_argument("--form", type=int, default=BY_FORM, help="findings to review by the form")
    parser.add_argument("--rest", action="store_true", help="go on, by the dock alone, with what a run in --folder left open")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended; --rest goes on"))  # so that QGIS and screen end, too
    if arguments.folder is not None:
        arguments.folder.mkdir(parents=True, exist_ok=True)
        sys.exit(run(arguments.folder.resolve(), arguments.pictures, arguments.count, arguments.form, arguments.rest))
    with tempfile.TemporaryDirectory(prefix="tunneldb-review-") as folder:
        code = run(Path(folder), arguments.pictures, arguments.count, arguments.form, False)
        tunneldb("server", "stop")
    sys.exit(code)


if __name__ == "__main__":
    main()
