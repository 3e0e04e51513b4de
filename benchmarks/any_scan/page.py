"""The page of documentation, from the verdicts."""

from __future__ import annotations

from typing import Any

HEAD = """# Any real scan

<!-- Written by python -m benchmarks.any_scan --table; edit benchmarks/any_scan/page.py, not this page. -->

What becomes of scans as people have them: {count} small ones, made by a generator of the benchmark's own, with its own
reflection law, noise and shapes. Each was taken through `tunnel add`, `survey add`, `load`, `run`, `leaks` and `report` as its
user would type them, and held against what had been written down beforehand as right. Of {count}, {right} came out right.

```sh
python -m benchmarks.any_scan                               # all, about {minutes} minutes
python -m benchmarks.any_scan --only d5 profiles-0.5        # some
python -m benchmarks.any_scan --table docs/real-scans.md    # this page
```

| word | right when |
|---|---|
| result | the leaks are found, each as one, and no false one |
| warning | the same, as far as the scan lets, and a line that names the matter |
| refusal | exit code 2, one line that names the matter, nothing half-written |

Never right, whatever was expected: an all-clear without a word of what was not looked at, a traceback, `leaks` and report
with different counts. Found and true are leaks; a leak is found when at least 30 % of it is covered. Where several are right,
any is.

| scene | what is special | expected | seen | found of true | false | right |
|---|---|---|---|---|---|---|
"""


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
    minutes = round(sum(v["seconds"] for v in verdicts.values()) / 60)
    text = HEAD.format(count=len(verdicts), right=sum(v["right"] for v in verdicts.values()), minutes=minutes)
    wrong = [v for v in verdicts.values() if not v["right"]]
    text += "\n".join(rows) + "\n"
    if missing:
        text += f"\nOf the matrix, but not in this table as not run yet: {', '.join(missing)}.\n"
    if wrong:
        text += "\n## Not right\n\n"
        text += "\n".join(f"- **{v['name']}**: {'; '.join(v['faults'])}".replace("<", "&lt;") for v in wrong) + "\n"
    return text
