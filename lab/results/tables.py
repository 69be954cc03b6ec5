"""The tables of README and docs that show results, each made from its records."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from statistics import mean, median
from typing import Any

from scipy.stats import ttest_rel

from lab.results.cells import (
    ASKED,
    Records,
    about,
    constant,
    hands,
    of_rate,
    share,
    table,
    with_interval,
)
from lab.results.readme_table import origin, readme
from lab.results.record import Record
from lab.studies.comparison.table import ratios, shares_of_arm
from lab.studies.comparison.table import tables as tables_of_comparison
from lab.studies.known_servos import table as known_servos

RATES = {
    "deserved": "named, and deserved",
    "sure_names_deserved": "of names told at 0.9 or more, deserved",
    "in_plant_or_class": "named, and in the plant or in a class with it",
    "material_faults_named": "faults worth a tenth of the squared error: named or in a class",
    "planted_found": "planted faults: named or in a class",
    "gear_by_one_name": "the gear's friction by load: one name or class",
    "intervals_hold": "intervals that hold the plant's number",
}
"""Rates of the strict score, with their words."""


def heeded(kept: Records) -> str:
    """Return what policies turn at the rates that they are asked for."""
    record = kept["turning_hands"]
    columns = []
    for asked in ASKED:
        seeds = [hands(record, f"heeding_{asked}_{seed}") for seed in record.seeds]
        packaged = seeds[0]
        near = sum(abs(one - asked) <= 0.15 * asked for one in packaged)
        close = sum(abs(mean(turned) - asked) <= 0.15 * asked for turned in seeds)
        means = about([mean(turned) for turned in seeds], 0)
        own = f"{about(packaged, 0)}; {near} of {len(packaged)}"
        columns.append([own, f"{means}; {close} of {len(seeds)}"])
    rows = zip(("seed 0, packaged", "means of seeds"), *columns, strict=True)
    return table(("policy", *(f"asked for {asked} rad/min" for asked in ASKED)), rows)


AS_THE_PAPER = {
    "ideal": "the paper's ideal source, default ranges",
    "network": "the Transformer of 36 minutes of its bench",
    "network of the next unit": "the Transformer of another bench",
    "diagnosed": "the diagnosis of a minute of its bench",
    "diagnosed of the next unit": "the diagnosis of another bench",
    "truth": "the plant's causes, tuned on its runs",
    "ranges": "data sheet, default ranges",
    "packaged": "the packaged policy, one for all",
}
"""Words for what policies were trained on."""
IN_THE_PAPER = {
    "ideal": ("ideal source, 4.2 N/rad, tip RMSE", 24.0),
    "network": ("Transformer, tip RMSE", 12.0),
    "diagnosed": ("diagnosed physical model, tip RMSE", None),
}
"""Words for what the paper measured of policies, and its figures [mm]."""


def units_of(errors: Mapping[str, Any]) -> dict[str, float]:
    """Return each unit's mean over its seeds."""
    return {
        unit: mean(own.values() if isinstance(own, Mapping) else own)
        for unit, own in sorted(errors.items())
    }


def beside(own: Mapping[str, float], other: Mapping[str, float]) -> str:
    """Return the share of errors in others, with the p of a test that is paired by unit."""
    both = sorted(own.keys() & other.keys())
    one, two = ([errors[unit] for unit in both] for errors in (own, other))
    return "1.00" if one == two else f"{sum(one) / sum(two):.2f} ({ttest_rel(one, two)[1]:.1g})"


def policies(kept: Records) -> str:
    """Return what policies miss on units, beside ideal source, data sheet and no motion at all."""
    figures = kept["paper_policies"].figures
    errors, settled = (
        {arm: units_of(own) for arm, own in figures[name].items()}
        for name in ("tip_error_mm", "settled_error_mm")
    )
    rows = [
        (
            words,
            figures["arms"][arm]["climbs"],
            about([*errors[arm].values()]),
            *(beside(errors[arm], errors[other]) for other in ("ideal", "ranges")),
            about([*settled[arm].values()]),
        )
        for arm, words in AS_THE_PAPER.items()
    ]
    still = ("none: the finger stands still where that is best", "", f"{figures['still_mm']:.1f}")
    heads = (
        "policy trained on", "climbs", "tip error [mm]: mean of units (range)",
        "share of the ideal source's (p)", "of the data sheet's (p)", "at the end of a stair [mm]",
    )  # fmt: skip
    climbs, failed = (
        sum(row[name] for row in figures["arms"].values()) for name in ("climbs", "failed")
    )
    return (
        f"{table(heads, [*rows, (*still, '', '', '')])}\n\n"
        f"No nearer than a finger that stands still: {failed} of {climbs} climbs."
    )


def mechanics(record: Record, worlds: Sequence[int]) -> str:
    """Return the time of a control step of 50 ms by engine."""
    rows = record.figures["mechanics"]["rows"]
    cells = {(row["engine"], row["worlds"]): row for row in rows}
    lines = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        last = cells[engine, worlds[-1]]
        times = [f"{cells[engine, count]['milliseconds']:.3g} ms" for count in worlds]
        step = f"{last['step_milliseconds']:.2f} ms"
        lines.append((f"`{engine}`", step, f"{1e3 * last['error_rad']:.1f} mrad", *times))
    counts = [f"{count:,} finger{'s' * (count > 1)}" for count in worlds]
    origin = f"Commit `{record.commit[:7]}`, {record.device}; {record.note}."
    return f"{table(('engine', 'step', 'error', *counts), lines)}\n\n{origin}"


def strict_rates(kept: Records) -> str:
    """Return how often names and intervals on benches with many faults are right."""
    totals = [kept[name].figures["summary"] for name in ("units", "rich")]
    lines = [
        (words, *(cell for total in totals for cell in
                  (of_rate(total.get(name)), constant(total, name))))
        for name, words in RATES.items()
    ]  # fmt: skip
    lines += [
        ("deserved names of a bench", *paired(f"{t['deserved_a_unit']:.1f}" for t in totals)),
        ("answers that are *unexplained*", *paired(t["unexplained"] for t in totals)),
        ("squared error gone: median, least",
         *paired(f"{t['gone_median']:.1%}, {t['gone_least']:.1%}" for t in totals)),
    ]  # fmt: skip
    units, rich = (total["units"] for total in totals)
    heads = ("rate (at least, 95 %)", f"{units} virtual units", "constant")
    return table((*heads, f"{rich} of the second plant", "constant"), lines)


def paired(cells: Iterable[Any]) -> list[Any]:
    """Return cells with an empty one behind each."""
    return [each for cell in cells for each in (cell, "")]


SECTIONS = {
    "single": "one cause",
    "pair": "two causes",
    "many": "three to five causes",
    "clean": "nothing planted",
    "outside": "a cause outside the catalogue",
    "form": "one cause, second form of the plant",
    "cell": "one cause, no load cell",
    "weak": "one cause of a tenth of the size",
    "other": "the second plant",
}
"""Sections of the exam, with their words."""
SHOWN = (
    ("single", "single: true cause first or in its class"),
    ("single", "single: nothing else named"),
    ("cell", "single: true cause first or in its class"),
    ("form", "single: true cause first or in its class"),
    ("other", "single: true cause first or in its class"),
    ("other", "single: nothing else named"),
    ("weak", "single: true cause first or in its class"),
    ("weak", "weak: true cause first or in its class"),
    ("pair", "pair: both found"),
    ("many", "many: recall"),
    ("many", "many: precision"),
    ("clean", "clean: no cause named"),
    ("clean", "clean: verdict no_gap"),
    ("other", "clean: no cause named"),
    ("other", "clean: verdict no_gap"),
    ("outside", "outside: no wrong name"),
    *((part, "parameters: 95 % interval holds the truth")
      for part in ("single", "cell", "form", "other", "weak", "pair", "many")),
)  # fmt: skip
"""Rates of the exam that its users read first: a section, and what is counted there."""
TIME = "seconds per dataset, median"
TOO_WEAK = ", below what is expected to be seen"


def exam_rows(kept: Records) -> str:
    """Return rates of the exam with their lower bounds, beside those of constant answers."""
    figures = kept["exam"].figures
    rows = []
    for section, name in SHOWN:
        rate = figures["sections"].get(section, {}).get(name)
        if not rate or rate["at_least"] is None:
            continue
        kind, said = name.replace("verdict no_gap", "verdict *no gap*").split(": ")
        constant = (share(rate.get("fixed")), share(rate.get("random")))
        found = of_rate({**rate, "hits": round(rate["value"] * rate["cases"]),
                         "of": rate["cases"], "rate": rate["value"]})  # fmt: skip
        words = SECTIONS[section] + (TOO_WEAK if kind == "weak" else "")
        rows.append((words, said, found, *constant))
    heads = ("sets", "right is", "rate (at least, 95 %)", "fixed answer", "random answer")
    return f"{table(heads, rows)}\n\n{missing(figures)}"


def missing(figures: Mapping[str, Any]) -> str:
    """Say how many of the drawn sets have an answer, by section: each answer took its time."""
    drawn = figures["drawn"]
    answered = {name: rates[TIME]["cases"] for name, rates in figures["sections"].items()}
    shares = [answered.get(name, 0) / drawn[name] for name in SECTIONS]
    return (
        f"{figures['sets']} of {sum(drawn.values())} drawn sets are answered, of each kind "
        f"{share(min(shares))} to {share(max(shares))}."
    )


def own_logs(record: Record) -> str:
    """Return what was planted in each stranger's logs, and what its diagnosis names."""
    rows = []
    for name, case in record.figures.items():
        where, seconds = name.replace("_", " "), f"{case['cpu_s']:.0f}"
        for found in case["diagnoses"].values():
            said = [
                " or ".join([cause, *row["or"]])
                + "".join(f", {v:.3g} [{a:.3g}, {b:.3g}]" for v, a, b in row["numbers"].values())
                for cause, row in found["found"].items()
            ]
            planted = [f"{c} {v:g}" for c, row in found["planted"].items() for v in row.values()]
            rows.append((where, "; ".join(planted), "; ".join(said), found["verdict"], seconds))
            where = seconds = ""
    heads = ("logs", "planted [SI]", "named [SI], 95 % interval", "verdict", "seconds of a core")
    return table(heads, rows)


IN_TIME = {
    ("days", "named_or_in_class"): "the number that changed comes first, or in its class",
    ("days", "nothing_else"): "nothing else has moved",
    ("days", "silent"): "of an unchanged day nothing is told",
    ("events", "named, all"): "an event is told, and by its kind",
    ("events", "in_time, all"): "it is told within 50 ms",
    ("events", "silent"): "of a run without nothing is told",
    ("events", "in_size, slip"): "the size of a slip is within a tenth",
    ("events", "in_size, skip"): "of a skip",
    ("events", "in_size, dip"): "of a dip",
    ("events", "in_size, knock"): "of a knock",
    ("events", "holds, knock"): "a knock told as *at least* so large is no smaller",
    ("mends", "moved"): "a named cause that was mended has moved",
    ("mends", "inside"): "by what was taken away, within its interval",
}
"""Rates of change that is told on virtual units, by part and name, with their words."""


def in_time(kept: Records) -> str:
    """Return how often what changed, happened or was mended is told rightly."""
    parts = kept["in_time"].figures
    lines = [
        (words, of_rate(parts[part]["rates"][name])) for (part, name), words in IN_TIME.items()
    ]
    return table(("right is", "rate (at least, 95 %)"), lines)


def kind_of(row: Mapping[str, Any]) -> str:
    """Return the kind of a row's experiment: sinusoids about several angles are one."""
    return row["experiment"].split(",")[0]


def paper(kept: Records) -> str:
    """Return our figures beside the paper's, of each kind of experiment in which it states one."""
    found = kept["paper"].figures
    stated = {kind_of(row) for row in found if row["paper"] is not None}
    rows = []
    for row in found:
        if kind_of(row) not in stated or row["unit"] == "%":
            continue
        theirs = "" if row["paper"] is None else f"{row['paper']:g} {row['unit']}"
        spread = f" ({row['low']:.3g} to {row['high']:.3g})" if row["count"] > 1 else ""
        ours = f"{row['ours']:.3g} {row['unit']}{spread}"
        rows.append((row["experiment"], row["measure"], theirs, ours, row["count"]))
    for arm, (words, stated_mm) in IN_THE_PAPER.items():
        own = [*units_of(kept["paper_policies"].figures["tip_error_mm"][arm]).values()]
        theirs = "" if stated_mm is None else f"{stated_mm:g} mm"
        ours = f"{median(own):.3g} mm ({min(own):.3g} to {max(own):.3g})"
        rows.append(("policy on the stairs", words, theirs, ours, len(own)))
    return table(("experiment", "measured", "paper", "ours: median (range)", "benches"), rows)


def cable_tool(kept: Records) -> str:
    """Return what programs leave of instruments' torque and jaw angle, by what is left out."""
    splits = kept["cable_tool"].figures
    rows = []
    for program in next(iter(splits.values())):
        both = ([*map(with_interval, own[program])] for own in splits.values())
        rows.append((program, *(f"{torque} mN m, {angle} mrad" for torque, angle in both)))
    return table(("", *splits), rows)


def whole_arm(kept: Records) -> str:
    """Return what models leave of an arm's squared error, and their errors by joint."""
    models = kept["arm"].figures
    joints = next(iter(models.values()))["joints"]
    rows = [
        [words, with_interval(own["pooled"], 3), f"{own['alike']:.3f}", *own["joints"].values()]
        for words, own in models.items()
    ]
    return table(("model", "pooled", "each pair alike", *joints), rows)


TABLES: dict[str, tuple[str, Callable[[Records], str]]] = {
    "readme": ("README.md", readme),
    "comparison": (
        "docs/comparison.md",
        lambda kept: tables_of_comparison(kept["comparison"].figures),
    ),
    "known servos": (
        "docs/known_servos.md",
        lambda kept: known_servos.table(kept["comparison"].figures),
    ),
    "losses": ("docs/comparison.md", lambda kept: ratios(kept["comparison"].figures)),
    "arm": ("docs/lab/so101.md", lambda kept: shares_of_arm(kept["comparison"].figures)),
    "whole arm": ("docs/lab/so101.md", whole_arm),
    "cable tool": ("docs/lab/cable_tool.md", cable_tool),
    "rates": ("docs/policies.md", heeded),
    "paper's policies": ("docs/lab/policies.md", policies),
    "mechanics on a GPU": (
        "docs/speed.md",
        lambda kept: mechanics(kept["gpu"], (1024, 16384, 65536)),
    ),
    "mechanics on a core": (
        "docs/speed.md",
        lambda kept: mechanics(kept["speed_cpu"], (1, 64, 1024)),
    ),
    "names": ("docs/lab/exams.md", strict_rates),
    "exam": ("docs/diagnosis.md", exam_rows),
    "in time": ("docs/in_time.md", in_time),
    "paper": ("docs/results.md", paper),
    "own logs": ("docs/lab/exams.md", lambda kept: own_logs(kept["own_logs"])),
}
"""File and maker of each table, by the name in its marks."""


class Asked(dict[str, Record]):
    """Records that tell which of them a table has asked for."""

    def __init__(self, kept: Records) -> None:
        super().__init__(kept)
        self.names: list[str] = []

    def __getitem__(self, name: str) -> Record:
        """Return a record, and note its name."""
        self.names.append(name)
        return super().__getitem__(name)


def shown(name: str, kept: Records) -> str:
    """Return a table as its page shows it: below it stands of which code its records are."""
    asked = Asked(kept)
    text = TABLES[name][1](asked)
    if name == "readme" or name.startswith("mechanics"):
        return text  # each row tells its own; the table tells it
    told = [f"{origin(kept[each])}, {kept[each].date}" for each in dict.fromkeys(asked.names)]
    return f"{text}\n\nMeasured at {'; '.join(told)}."
