"""Tables of what detection is worth on a round."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.blind.run import Outcome
from benchmarks.blind.score import (
    LEAST,
    LOOKS,
    MOST,
    SMALLEST,
    Scored,
    by_drop,
    by_phenomenon,
    by_size,
    calibration_error,
    hold,
    reliability,
    review,
    row,
    waterproofing,
)
from benchmarks.blind.statistics import CLASSES, Agreement
from benchmarks.blind.waterproof import STRETCH
from benchmarks.common import print_table
from tunneldb.evaluate.measure import Figures

HEADER = ("scene", "true", "found", "called", "right", "false", "leak R", "leak P", "leak F1", "area R", "area P", "area F1",
          "area p95", "edge p95", "pieces", "false/1000", "class")  # fmt: skip
CLASSED = ("", "true", "touched", "found", "leak R", "area R", "area p95", "edge p95", "called", "right", "leak P", "area P")


def show(name: str, outcomes: Sequence[Outcome], refused: Sequence[str] = ()) -> None:
    """Print the tables of a round.

    Parameters
    ----------
    name : str
    outcomes : sequence of Outcome
    refused : sequence of str
        Scenes of the round of which there is no outcome.
    """
    scored = hold(outcomes)
    print_table(name, HEADER, [*(cells(one.scene, [one]) for one in outcomes), cells("all", outcomes)])
    _left_out(scored, refused)
    print_table("by size", CLASSED, [_figures(size, f) for size, f in by_size(scored)])
    print_table("by drop", CLASSED, [_figures(drop, f) for drop, f in by_drop(scored)])
    print(f"of no drop: {(scored.comparison.found_group < 0).sum()} that are called and touch no true leak")
    phenomena = by_phenomenon(scored)
    print_table("by phenomenon", ("", "true", "found", "area R"), [(k, n, f, f"{a:.2f}") for k, (n, f, a) in phenomena.items()])
    _classes(outcomes)
    _probabilities(outcomes)
    _review(outcomes)


def cells(name: str, outcomes: Sequence[Outcome]) -> list[str]:
    """Figures of scenes, as they stand in a line of a table."""
    v = row(hold(outcomes))
    counts = [str(int(v[key])) for key in ("true", "found", "called", "right", "false")]
    shares = [f"{v[key]:.3f}" for key in ("recall", "precision", "f1", "area_recall", "area_precision", "area_f1")]
    line = [name, *counts, *shares, _percent(v["area_error_p95"]), _millimetres(v["edge_p95"]),
            f"{v['pieces']:.2f}", f"{v['false_per_1000']:.2f}", _class(outcomes)]  # fmt: skip
    return ["" if cell.startswith("nan") else cell for cell in line]


def _class(outcomes: Sequence[Outcome]) -> str:
    """Class of waterproofing that came out of a scene, and the true one if it is another; of several how often it was right."""
    if len(outcomes) == 1 and outcomes[0].found_classes and outcomes[0].true_classes:
        found, true = outcomes[0].found_classes[0], outcomes[0].true_classes[0]
        return f"{found}" if found == true else f"{found} for {true}"
    agreement, _ = waterproofing(outcomes)
    return f"{agreement.right}/{agreement.table.sum()}" if agreement.table.any() else ""


def _left_out(scored: Scored, refused: Sequence[str]) -> None:
    """Say what stands in no figure, and how many that are."""
    v = row(scored)
    untouched, small = int(v["true"] - v["touched"]), int(v["false_small"])
    print(f"not demanded: {scored.small} true leaks smaller than {SMALLEST:g} m², {scored.limited} that can't be told (limit)")
    print(f"touched by nothing, without area error and edges: {untouched} of {int(v['true'])} true leaks")
    print(
        f"not in leak P: {small} of the false ones, of {LEAST:g} to {SMALLEST:g} m²;"
        f" with them it is {v['strict_precision']:.3f}, leak F1 {v['strict_f1']:.3f}"
    )
    if refused:
        print(f"refused, and in no figure: {', '.join(refused)}")
    if nothing := [one.scene for one in scored.outcomes if one.seen == 0.0]:
        print(f"refused, all of their leaks missed: {', '.join(nothing)}")


def _figures(name: str, f: Figures) -> list[str]:
    line = [name, str(f.true), str(f.touched), str(f.found), f"{f.recall:.3f}", f"{f.area_recall:.3f}",
            _percent(f.area_error_p95), _millimetres(f.edge_p95), str(f.called), str(f.right), f"{f.precision:.3f}",
            f"{f.area_precision:.3f}"]  # fmt: skip
    return ["" if cell.startswith("nan") else cell for cell in line]


def _classes(outcomes: Sequence[Outcome]) -> None:
    """Print the classes of waterproofing that came out against the true ones."""
    limited = any(limit for one in outcomes for limit in one.limits)
    for told, of in ((False, "all true leaks"), (True, "true leaks that can be told")):
        if told and not limited:
            continue
        for agreement, what in zip(waterproofing(outcomes, told), ("scenes", f"stretches of {STRETCH:g} m"), strict=True):
            if not agreement.table.any():
                print(f"\nclass of waterproofing (GB 50108) of {what}, by {of}: not known")
                continue
            print_table(
                f"class of waterproofing (GB 50108) of {what}, by {of}",
                ("true", *(f"found {number}" for number in range(1, CLASSES + 1))),
                [(number, *line.tolist()) for number, line in enumerate(agreement.table, 1)],
            )
            print(_agreement(agreement))


def _agreement(a: Agreement) -> str:
    count = int(a.table.sum())
    named = (("right", a.right), ("one class off", a.near), ("too good (lenient)", a.lenient), ("too bad", a.strict))
    return f"of {count}: " + ", ".join(f"{what} {n} ({n / count:.2f})" for what, n in named) + f"; not known: {a.unknown}"


def _probabilities(outcomes: Sequence[Outcome]) -> None:
    r = reliability(outcomes)
    lines = zip(r.stated, r.true, r.low, r.high, r.count, strict=True)
    print_table(
        "probabilities", ("", "stated", "true", "95 %", "number"),
        [("", f"{s:.2f}", f"{t:.2f}", f"{low:.2f} to {high:.2f}", int(n)) for s, t, low, high, n in lines if n],
    )  # fmt: skip
    print(f"calibration error {calibration_error(outcomes):.3f}")


def _review(outcomes: Sequence[Outcome]) -> None:
    each, shares, every = review(outcomes)
    seen = [(f"{looks:g}", f"{share:.3f}") for looks, share in zip(LOOKS, shares, strict=True)]
    print_table(
        "review in order of probability", ("looks for each true leak", "leaks seen"), [*seen, ("all there are", f"{every:.3f}")]
    )
    print(f"{each:.2f} looks for each leak seen, until {MOST:g} of those that can be seen are")


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _millimetres(distance: float) -> str:
    return f"{1000 * distance:.0f} mm"
