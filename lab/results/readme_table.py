"""The README's table of results: first what a constant answer does not reach."""

from collections.abc import Callable
from statistics import mean

from lab.results.cells import ASKED, Records, about, constant, hands, share, table
from lab.results.record import Record
from lab.studies.comparison.table import OTHERS, OURS, REPEATS, beside_rivals, distinct_fits

NAMED, ALONE = "single: true cause first or in its class", "single: nothing else named"
Row = tuple[str, str, str]  # Figure, what stands beside it, and what a constant answer reaches


def one_cause(kept: Records) -> Row:
    """Return how often a single planted cause is named, and how often others besides."""
    exam = kept["exam"].figures
    own, second = (exam["sections"][name] for name in ("single", "other"))
    drawn = sum(exam["drawn"].values())
    partly = "" if exam["sets"] == drawn else f"; {exam['sets']} of {drawn} sets"
    told = [
        f"{round(rate['value'] * rate['cases'])} of {rate['cases']}"
        for section in (own, second)
        for rate in (section[NAMED], section[ALONE])
    ]
    return (
        told[0],
        f"nothing else: {told[1]}; second plant: {told[2]}, {told[3]}{partly}",
        f"fixed {share(own[NAMED]['fixed'])}, random {share(own[NAMED]['random'])}",
    )


def planted(kept: Records) -> Row:
    """Return how many planted faults of rich benches are named, and which names are deserved."""
    total = kept["rich"].figures["summary"]
    found, deserved = total["planted_found"], total["deserved"]
    return (
        f"{found['hits']} of {found['of']} faults",
        f"{deserved['hits']} of {deserved['of']} names are deserved",
        constant(total, "planted_found"),
    )


def servo(name: str) -> Callable[[Records], Row]:
    """Return our error on a servo's splits; on each the best of other programs, and of ours."""

    def cells(kept: Records) -> Row:
        figures = kept["comparison"].figures
        plain = {row for rows in figures.values() for row in rows} - {REPEATS, OURS, *OTHERS}
        kinds = {"Rhoban/bam": OTHERS, "plain": plain}
        found = {
            kind: [s for s in beside_rivals(figures, rivals) if s.split.startswith(name)]
            for kind, rivals in kinds.items()
        }
        splits = [s.split for s in found["plain"]]
        fits = distinct_fits(figures, splits)
        of_fits = "" if fits == len(splits) else f" of {fits} fits"
        told = [f"{kind} {about([s.left for s in each])}" for kind, each in found.items() if each]
        ours = about([s.ours["held_out"] for s in found["plain"]])
        return f"{ours} mrad", f"{len(splits)} splits{of_fits}; {', '.join(told)}", ""

    return cells


def stairs(kept: Records) -> Row:
    """Return what policies of diagnoses miss on their units, those of others, and one for all."""
    figures = kept["paper_policies"].figures
    units = {
        arm: [mean(seeds.values()) for seeds in figures["tip_error_mm"][arm].values()]
        for arm in ("diagnosed", "network", "ideal", "packaged")
    }
    network, ideal, packaged = (mean(units[arm]) for arm in ("network", "ideal", "packaged"))
    return (
        f"{about(units['diagnosed'])} mm",
        f"{len(units['diagnosed'])} diagnosed; Transformer {network:.1f}, ideal {ideal:.1f}",
        f"one policy {packaged:.1f}",
    )


def ball(kept: Records) -> Row:
    """Return what the packaged policy turns at each rate, and its recipe's seeds at one."""
    record = kept["turning_hands"]
    turned = ", ".join(f"{mean(hands(record, f'heeding_{asked}_0')):.0f}" for asked in ASKED)
    seeds = [
        about([mean(hands(record, f"heeding_{asked}_{seed}")) for seed in record.seeds], 0)
        for asked in ASKED
    ]
    return f"{turned} rad/min", f"{len(record.seeds)} seeds: {', '.join(seeds)}", ""


def fingers(kept: Records) -> Row:
    """Return how much faster fingers are simulated than by MuJoCo on a GPU."""
    rows = kept["gpu"].figures["mechanics"]["rows"]
    times = {row["engine"]: row["milliseconds"] for row in rows if row["worlds"] == 65536}
    ours, theirs = times["TendonSolver, same step"], times["mujoco_warp, native tendon"]
    return f"{theirs / ours:.0f} times", f"{ours:.3f} and {theirs:.1f} ms a step", ""


README: dict[str, tuple[str, Callable[[Records], Row]]] = {
    "[One hidden cause of 42](docs/diagnosis.md#how-often-it-is-right): named":
        ("exam", one_cause),
    "[Two faults beside twelve imperfections](docs/lab/exams.md#benches-with-twenty-faults):"
    " named": ("rich", planted),
    "[Real STS3215 servo](docs/comparison.md): held-out angle error":
        ("comparison", servo("sts3215")),
    "[Real XL330 servo](docs/comparison.md#where-we-lose): the same":
        ("comparison", servo("xl330")),
    "[Real SO-101 arm](docs/lab/so101.md): held-out RMS error, six joints":
        ("comparison", servo("so101")),
    "[Ten virtual fingers on stairs](docs/lab/policies.md#the-papers-experiment): tip error":
        ("paper_policies", stairs),
    "[Ball on ten virtual hands](docs/policies.md#turning-a-ball), asked for 30, 60, 90 rad/min":
        ("turning_hands", ball),
    "[65,536 fingers on one H200](docs/speed.md#one-h200), as fast as `mujoco_warp`":
        ("gpu", fingers),
}  # fmt: skip
"""Record and figures of each row of the README, by its words."""


def readme(kept: Records) -> str:
    """Return the README's results."""
    rows = []
    for words, (name, cells) in README.items():
        number, beside, reached = cells(kept)
        rows.append((words, f"**{number}**", beside, reached, origin(kept[name])))
    return table(
        ("result", "rate; mean (range)", "beside it", "constant answer", "measured at"), rows
    )


def origin(record: Record) -> str:
    """Return where a record was measured, and how many of its cells are of older code."""
    older = sum(record.older.values())
    return f"`{record.commit[:7]}`" + (f", {older} older" if older else "")
