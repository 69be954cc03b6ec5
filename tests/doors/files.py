"""The table of mistakes in files and mappings: each is read right, or told with its mend."""

import json
import re
from functools import partial
from pathlib import Path

import numpy as np

from tests.doors.logs import COUNT, ROWS, Columns, Edit, csv_logs, lerobot, lone, own_dataset
from tests.doors.mistakes import CSV, LEROBOT, OWN, Mistake, Spoil, put


def edit(old: str, new: str) -> Edit:
    """Return a change of a text, which must hold what is changed."""

    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return change


def in_file(name: str, said: str, of: Edit, *, suffix: str = ".csv") -> Mistake:
    """Return a mistake in the form of a file."""
    return Mistake(name=name, said=said, doors={CSV: csv_logs(of=of, suffix=suffix)})


def in_mapping(name: str, said: str, mapping: Edit) -> Mistake:
    """Return a mistake in a mapping."""
    return Mistake(name=name, said=said, doors={CSV: csv_logs(mapping=mapping)})


def by_servo(text: str) -> str:
    """Write a row for each servo, with its number."""
    rows = [line.split(",") for line in text.splitlines()[1:]]
    each = (f"{t},{k},{a},{b}" for t, *x in rows for k, a, b in ((1, *x[:2]), (2, *x[2:])))
    return "\n".join(["t,id,goal_0,q_0", *each]) + "\n"


def of_bench(name: str, said: str, spoil: Spoil, mapping: Edit = str) -> Mistake:
    """Return a mistake in a log of the finger, whose asset says what it can do."""
    doors = {CSV: csv_logs("finger", mapping=mapping)}
    return Mistake(name=name, said=said, spoil=lambda run: (lone(run), spoil(run)), doors=doors)


def stamped(unit: float, start: float = 0.0) -> Spoil:
    """Return stamps of so many units a second, from an instant on."""
    return lambda run: run.__setitem__("t", unit * (run["t"] + start))


def ragged(text: str) -> str:
    """Cut a row in its middle."""
    rows = text.splitlines()
    rows[500] = rows[500][:9]
    return "\n".join(rows) + "\n"


def of_kind(name: str, said: str, spoil: Spoil) -> Mistake:
    """Return a mistake in the columns of anybody's CSV files."""
    return Mistake(name=name, said=said, spoil=spoil, doors={CSV: csv_logs()})


def halved(folder: Path, runs: list[Columns]) -> list[str]:
    """Lose the second half of the last episode of a LeRobotDataset."""
    words = lerobot(folder, [runs[0], {name: values[:400] for name, values in runs[1].items()}])
    path = folder / "arm" / "meta" / "info.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "total_frames": 2 * ROWS}))
    return words


def stated(folder: Path, runs: list[Columns], **changes: object) -> list[str]:
    """State something else of a LeRobotDataset: at its top, or of its actions."""
    words = lerobot(folder, runs)
    path = folder / "arm" / "meta" / "info.json"
    info = json.loads(path.read_text())
    info["features"]["action"] |= {key: x for key, x in changes.items() if key == "names"}
    path.write_text(json.dumps(info | {key: x for key, x in changes.items() if key == "fps"}))
    return words


def emptied(folder: Path, runs: list[Columns]) -> list[str]:
    """Lose all rows of a LeRobotDataset."""
    return lerobot(folder, [{name: values[:0] for name, values in run.items()} for run in runs])


def summed(folder: Path, runs: list[Columns]) -> list[str]:
    """Let a summary of a program lie beside the logs."""
    words = csv_logs()(folder, runs)
    (folder / "logs" / "summary.csv").write_text("run,error\n1,0.2\n2,0.3\n")
    return words


def pulled(run: Columns) -> None:
    """Give the finger a tension as a servo of 4.2 N/rad pulls."""
    run["force"] = 2.0 + 4.2 * (run["goal"] - run["q"])


def pushing(run: Columns) -> None:
    """Turn the tension around."""
    pulled(run)
    run["force"] *= -1.0


GAIN = '[model]\nkind = "ideal"\ngain = {:.6g}\nspool_radius = 0.0125\n'
PWM = """[model]
kind = "pwm_servo"
duty_per_rad = {:.6g}
max_duty = 1.0
supply_voltage = 5.0
torque_constant = 0.4
armature = 0.001
resistance = 5.0
spool_radius = 0.0125
"""
FILES: tuple[Mistake, ...] = (
    of_kind("stamps in milliseconds", 'unit = "ms"', stamped(1e3)),
    of_kind("stamps in microseconds", 'unit = "us"', stamped(1e6)),
    of_kind("stamps in nanoseconds since 1970", 'unit = "ns"', stamped(1e9, 1.7e9)),
    of_kind("stamps in hours", 'unit = "h"', stamped(1.0 / 3600.0)),
    of_kind("stamps of a spreadsheet", 'unit = "d"', stamped(1.0 / 86400.0, 86400.0 * 45234.5)),
    in_mapping("stamps in seconds said to be in milliseconds", 'look like seconds (unit = "s"',
        edit('"t"', '"t", unit = "ms"')),
    in_file("decimal commas between commas", "cells, and the header 5",
        lambda text: re.sub(r"(\d)\.(\d)", r"\1,\2", text)),
    of_kind("stamps in minutes", 'unit = "min"', stamped(1.0 / 60.0)),
    in_file("a second run below the first", "a second run begins", lambda text: text + text),
    in_file("a list in a cell", 'column = "goal_0[0]" in the mapping',
        lambda text: re.sub(r"\n([\d.]+),([^,\n]+)", r'\n\1,"[\2]"', text)),
    in_file("a number in hexadecimal digits", "as a decimal number",
        edit("\n0.05,0", "\n0.05,0x1f")),
    Mistake(name="a row for each servo", said="write one file a servo",
        doors={CSV: csv_logs(of=by_servo, mapping=lambda text: "\n".join(
            line.replace("_0 =", " =") for line in text.splitlines() if "_1" not in line
            and "joints" not in line))}),
    in_mapping("an offset in degrees", "90 deg are offset = 1.571",
        edit('"q_0"', '"q_0", offset = 90.0')),
    in_mapping("an offset of half a turn in degrees", "180 deg are offset = 3.142",
        edit('"q_0"', '"q_0", offset = 180.0')),
    of_kind("counts for both", "scale = 0.00153398 of 4096 a turn",
        lambda run: run.update(
            {n: np.round(2048.0 + run[n] / COUNT) for n in run if n != "t"})),
    in_file("a column of another name", "no column named", edit("goal_1", "soll_1")),
    in_file("two columns of one name", "2 columns are named 'goal_0'", edit("goal_1", "goal_0")),
    in_file("no header", "names in header = [...]", lambda text: text.split("\n", 1)[1]),
    in_file("lines above the header", "2 lines above its header", lambda text: f"Rig\n1,2\n{text}"),
    in_file("cells between spaces", "cells separated by ' '", edit(",", "  ")),
    in_file("a date as Germans write it", "as ISO writes them", edit("\n0.05,", "\n4.3.26 1:02,")),
    of_kind("a time of day at midnight", "midnights that pass: 1",
        lambda run: run.update(t=(run["t"] + 86398.0) % 86400.0)),
    in_file("a row that ends early", "rows without a number", ragged),
    in_file("a word for a number", "must be a number", edit("\n0.05,", "\nfast,")),
    in_file("an empty file", "two rows or more", lambda text: ""),
    in_file("a spreadsheet", "save it as CSV", str, suffix=".xlsx"),
    in_file("a packed log", "unpack it", str, suffix=".csv.gz"),
    in_file("a bag of ROS 1", "rosbags-convert", str, suffix=".bag"),
    in_file("a comment in the middle", "comments after '#'",
        edit("\n0.05,", "\n# the motor was warm\n0.05,")),
    in_file("a row of units", "a row of units below the header",
        edit("q_1\n", "q_1\n[s],[rad],[rad],[rad],[rad]\n")),
    in_file("degrees by a row of units", 'say unit = "deg" for it',
        edit("q_1\n", "q_1\ns,rad,rad,deg,deg\n")),
    in_mapping("a column twice", "one column is one quantity",
        lambda text: text + 'current = {column = "q_0"}\n'),
    in_mapping("a unit of nobody", "No unit named", edit('"q_0"', '"q_0", unit = "grad"')),
    in_mapping("a command in rad said to be in degrees", 'say unit = "rad" for it',
        edit('"goal_0"', '"goal_0", unit = "deg"')),
    in_mapping("an angle in rad said to be in degrees", 'say unit = "rad" for it',
        edit('"q_0"', '"q_0", unit = "deg"')),
    in_mapping("a column that is not ours", "No column named", edit("theta_d_0", "target_0")),
    in_mapping("three names for two joints", "one per servo",
        edit('["pan", "lift"]', '["pan", "lift", "grip"]')),
    in_mapping("a joint without its angle", "theta", edit('theta_1 = {column = "q_1"}\n', "")),
    Mistake(name="a negative tension", said="a string cannot push",
        spoil=lambda run: (lone(run), pushing(run)), thread="olkal/HX711_ADC#80",
        doors={CSV: csv_logs("finger"), OWN: partial(own_dataset, bench="finger")}),
    of_bench("a tension in grams", "in another unit",
        lambda run: (pulled(run), run.update(force=102.0 * run["force"]))),
    of_bench("a cell at its end", "no sensor reads farther",
        lambda run: (pulled(run), run.update(force=np.minimum(run["force"], 2.2)))),
    of_bench("a spike of the cell", "the load cell was not read there",
        lambda run: (pulled(run), put("force", slice(300, 301), 900.0)(run))),
    of_bench("angle and command turned around", "angles grow as the string is wound in",
        lambda run: (pulled(run), run.update(goal=-1.5 - run["goal"], q=-1.5 - run["q"]))),
    of_bench("radians said to be degrees", 'taken for degrees (unit = "rad" in the mapping)',
        lambda run: (pulled(run), run.update({n: np.deg2rad(run[n]) for n in ("goal", "q")}))),
    of_bench("sixteen kilograms", "masses are in kg", pulled,
        lambda text: 'bench_overrides = {mass = [16.0, 8.0]}\n' + text),
    of_bench("a negative gain", "must be between", pulled,
        lambda text: text + '[model]\nkind = "ideal"\ngain = -4.2\nspool_radius = 0.0125\n'),
    of_bench("millimetres for metres of an arm", "moment arms are in m", pulled,
        lambda text: 'bench_overrides = {moment_arm = [8.0, 5.5]}\n' + text),
    of_bench("a spring by the degree", "one of N m/deg is times 57.3", pulled,
        lambda text: 'bench_overrides = {stiffness = [0.000785, 0.000523]}\n' + text),
    of_bench("a gain by the degree", "gain is in N/rad at the spool", pulled,
        lambda text: text + GAIN.format(4.2 / 57.3)),
    of_bench("a gain of the torque", "gain is in N/rad at the spool", pulled,
        lambda text: text + GAIN.format(4.2 * 0.0125)),
    of_bench("a P register of another family", "or a register's count", pulled,
        lambda text: text + PWM.format(32.0)),
    of_bench("a resistance in milliohm", "resistance [ohm]", pulled,
        lambda text: text + PWM.format(1.05 * 4.2).replace("5.0\nspool", "0.2\nspool")),
    of_bench("a register for a duty", "must be between 0.00333 and 300 1/rad on finger", pulled,
        lambda text: text + PWM.format(850.0)),
    of_bench("an unknown number to fit", "No number to fit named 'kp'", pulled,
        lambda text: 'fit = ["kp"]\n' + text + GAIN.format(4.2)),
    of_bench("a period for the cell's rate", "readings a second", pulled,
        lambda text: "load_cell_rate = 0.0125\n" + text + GAIN.format(4.2)),
    of_bench("a bench's name", "did you mean 'finger'?", pulled, edit('"finger"', '"fingr"')),
    Mistake(name="a rate that is not the stamps'", said="correct timestamp or fps",
        doors={LEROBOT: partial(stated, fps=30)}),
    Mistake(name="one name for two joints", said="in the order of the row",
        doors={LEROBOT: partial(stated, names=["pan.pos"])}),
    Mistake(name="a dataset without rows", said="this file has none", doors={LEROBOT: emptied}),
    Mistake(name="a summary beside the logs", said="takes some files alone", doors={CSV: summed}),
    Mistake(name="half of an episode", said="files of rows are missing", doors={LEROBOT: halved}),
)  # fmt: skip
