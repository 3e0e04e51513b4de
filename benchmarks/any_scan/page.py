"""The page of documentation, from the verdicts."""

from __future__ import annotations

from typing import Any

from benchmarks.any_scan.ways import WAYS

HEAD = """# Typical real scans

<!-- Written by python -m benchmarks.any_scan --table; edit benchmarks/any_scan/page.py, not this page. -->

How tunneldb handles typical defects of real scans: {count} small scans of a generator with its own reflection law,
noise and shapes.
Each passed through `tunnel add`, `survey add`, `load`, `run`, `leaks` and `report`, and was compared with an outcome specified
beforehand. {right} of {count} are right.

```sh
python -m benchmarks.any_scan                               # all
python -m benchmarks.any_scan --only d5 profiles-0.5        # some
python -m benchmarks.any_scan --table docs/real-scans.md    # this page
```

| outcome | right if |
|---|---|
| result | every leak is found as one, without a false one |
| warning | likewise, as far as the scan permits, and a line names the problem |
| refusal | exit code 2, one line names the problem, nothing is half-written |

Always wrong: no statement of lining that was not inspected, a traceback,
different counts in `leaks` and report. A leak is found if at
least 30 % of it is covered. If several outcomes are listed, any of them is right.

| scene | defect or property | expected | actual | found of all leaks | false | right |
|---|---|---|---|---|---|---|
"""


MAX_LINE = 300
"""Characters of a message that are printed."""

WAYS_HEAD = """
## Ways of doing it wrong

What each command says of a mistake, up to the one that refuses; `inspect` with stations, trajectory and axis beside the
scan. The step at which the user first learns of it is bold.

| mistake | step | message |
|---|---|---|
"""


def _ways(verdicts: dict[str, Any]) -> str:
    rows = []
    for way, name in WAYS.items():
        first = True
        for number, step in enumerate(verdicts[name]["steps"] if name in verdicts else []):
            line = step["line"].removeprefix("tunneldb: ")
            line = (line if len(line) <= MAX_LINE else f"{line[:MAX_LINE]} …").replace("|", "\\|").replace("<", "&lt;")
            command = f"`{step['command']}`"
            bold, first = first and bool(line), first and not line
            said = f"{'refused: ' if step['refused'] else ''}{line}" if line else "nothing"
            rows.append(f"| {'' if number else f'{way} ({name})'} | {f'**{command}**' if bold else command} | {said} |")
    return WAYS_HEAD + "\n".join(rows) + "\n"


def page(verdicts: dict[str, Any], names: list[str]) -> str:
    """Return the page as Markdown, in the order of the scenes' `names`."""
    missing = [name for name in names if name not in verdicts]
    verdicts = {name: verdicts[name] for name in names if name in verdicts}
    rows = []
    for v in verdicts.values():
        counted = v["seen"] != "refusal"
        found = f"{v['found']} of {v['true']}" if counted else "–"
        false = v["false"] if counted else "–"
        cells = [v["name"], v["special"], v["expect"].replace("|", " or "), v["seen"], found, false]
        rows.append("| " + " | ".join(map(str, [*cells, "yes" if v["right"] else "**no**"])) + " |")
    text = HEAD.format(count=len(verdicts), right=sum(v["right"] for v in verdicts.values()))
    wrong = [v for v in verdicts.values() if not v["right"]]
    text += "\n".join(rows) + "\n"
    if missing:
        text += f"\nNot run yet: {', '.join(missing)}.\n"
    if wrong:
        text += "\n## Wrong outcomes\n\n"
        text += "\n".join(f"- **{v['name']}**: {'; '.join(v['faults'])}".replace("<", "&lt;") for v in wrong) + "\n"
    return text + _ways(verdicts)
