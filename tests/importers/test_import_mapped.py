"""Anybody's logs become recordings by a mapping file, and a wrong mapping says what is wrong."""

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.formats.mapped_column import UNITS
from tendon_newton.data.importers.column_mapping import read_mapping
from tendon_newton.data.model_file import load_model
from tendon_newton.data.recording import Recording

TIME = np.arange(200) / 100.0
COLUMNS = """
t = {column = "time_ms", unit = "ms"}
theta_d = {column = "goal", unit = "deg", sign = -1}
theta = {column = "angle", unit = "deg", sign = -1, offset = 0.1}
theta_dot = {column = "rpm", unit = "rev/min", sign = -1}
force = {column = "grams", unit = "g"}
"""


LED = '[model]\nkind = "measured_path"\n'


def rows_of(*columns: np.ndarray) -> list[str]:
    """Return the rows of a CSV file with these columns."""
    return [",".join(map(repr, row)) for row in np.column_stack(columns).tolist()]


def two_runs(folder: Path, lines: Callable[[int], Sequence[str]]) -> Path:
    """Write two logs of lines that follow from a run's number, 1 or 2; return their folder."""
    (logs := folder / "logs").mkdir()
    for k in (1, 2):
        (logs / f"run_{k}.csv").write_text("\n".join(lines(k)) + "\n")
    return logs


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two CSV logs in units of their own."""

    def lines(k: int) -> list[str]:
        angle, rpm = 30.0 * np.sin(k * TIME), 30.0 * k * np.cos(k * TIME) / 6.0
        rows = rows_of(1e3 * TIME, 1.1 * angle, angle, rpm, 100.0 + angle)
        return ["time_ms,goal,angle,rpm,grams", *rows]

    return two_runs(tmp_path, lines)


def derived(**columns: str) -> str:
    """Return a mapping's columns in our units, whose speed is derived from the angle."""
    lines = [f'{ours} = {{column = "{theirs}"}}' for ours, theirs in columns.items()]
    return "\n".join([*lines, 'theta_dot = {derive = "theta"}'])


def mapping(folder: Path, columns: str = COLUMNS, head: str = 'bench = "spring_weak"') -> Path:
    """Write a mapping file."""
    path = folder / "mapping.toml"
    path.write_text(f"{head}\n[columns]\n{columns}")
    return path


def imported(folder: Path, columns: str, head: str = 'bench = "servo"') -> tuple[Recording, ...]:
    """Import the logs of a folder by a mapping; return the two runs."""
    assert run_import(folder / "logs", mapping(folder, columns, head), folder / "out") == 0
    loaded = load_dataset(folder / "out")
    return (*loaded.train, *loaded.test)


def run_import(logs: Path, path: Path, out: Path, *more: str) -> int:
    """Run the command line."""
    words = ["import", "mapped", str(logs), "--mapping", str(path), "--out", str(out), *more]
    return main([*words, "--test", "part1=2"])


def test_units_signs_and_offsets_are_applied(logs: Path, tmp_path: Path) -> None:
    """Degrees, rev/min, grams and milliseconds become SI, to the rounding of a CSV file."""
    assert run_import(logs, mapping(tmp_path), tmp_path / "out") == 0
    loaded = load_dataset(tmp_path / "out")
    assert [r.name for r in (*loaded.train, *loaded.test)] == ["run_1.csv", "run_2.csv"]
    run = loaded.train[0]
    angle = np.deg2rad(30.0 * np.sin(TIME))
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_allclose(run.motor_position[:, 0], 0.1 - angle, atol=1e-8)
    assert run.command is not None
    np.testing.assert_allclose(run.command[:, 0], -1.1 * angle, atol=1e-8)
    speed = -np.deg2rad(30.0) * np.cos(TIME)
    np.testing.assert_allclose(run.motor_velocity[:, 0], speed, atol=1e-8)
    weight = (100.0 + 30.0 * np.sin(TIME)) * 9.80665e-3
    assert run.force is not None
    np.testing.assert_allclose(run.force[:, 0], weight, atol=1e-8)
    assert load_model(tmp_path / "out" / "model.toml").actuator.name == "ideal"


def test_json_paths_rates_and_derived_speeds(tmp_path: Path, capsys) -> None:
    """Rows below a key, which is named where nobody said it, numbers in lists, no time or speed."""
    folder = tmp_path / "logs"
    folder.mkdir()
    rows = [{"goal": [0.0, float(a)], "state": {"q": [0.0, float(a)]}} for a in np.sin(TIME)]
    for k in (1, 2):
        (folder / f"run_{k}.json").write_text(json.dumps({"log": rows, "who": k}))
    columns = derived(theta_d="goal[1]", theta="state.q[1]")
    head = 'bench = "servo"\nfiles = "*.json"\nrows = "log"\nrate = 100\nstart = "first_row"'
    run, _ = imported(tmp_path, columns, head)
    assert run.start == "first_row"
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    # central differences of a sine at 100 Hz; one-sided at the ends
    np.testing.assert_allclose(run.motor_velocity[:, 0], np.cos(TIME), atol=1e-2)
    assert load_model(tmp_path / "out" / "model.toml").actuator.name == "ideal_position"
    unsaid = mapping(tmp_path, columns, head.replace('rows = "log"\n', ""))
    assert run_import(folder, unsaid, tmp_path / "new") == 2
    assert 'say rows = "log" in the mapping' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("columns", "head", "words"),
    [
        (COLUMNS.replace("deg", "degree"), None, "No unit named 'degree'"),
        (COLUMNS.replace('"angle"', '"angel"'), None, "no column named 'angel'"),
        (COLUMNS.replace("theta_dot", "speed"), None, "No column named 'speed'"),
        (COLUMNS.replace("sign = -1", "sign = 2"), None, "sign must be 1 or -1"),
        (COLUMNS.replace('unit = "g"', 'unit = "g", scale = 2.0'), None, "not both"),
        (COLUMNS.replace("\nt = ", "\n#"), None, "must say where 't' comes from"),
        (COLUMNS, 'bench = "spring_weak"\nrate = -1', "rate must be a positive number"),
        (COLUMNS, 'bench = "spring_weak"\nfiles = "*.json"', "no log matches"),
        (COLUMNS, 'bench = "spring_weak"\nfit = 3', "fit must be a list"),
        (COLUMNS, "rate = 100", "'bench' is missing"),
    ],
)
def test_a_wrong_mapping_is_one_line_that_says_so(
    logs: Path, tmp_path: Path, capsys, columns: str, head: str | None, words: str
) -> None:
    """Exit code 2 and a message that names the fault; no traceback."""
    path = mapping(tmp_path, columns, head or 'bench = "spring_weak"')
    assert run_import(logs, path, tmp_path / "out") == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1


def test_mapping_belongs_to_mapped_alone(logs: Path, tmp_path: Path, capsys) -> None:
    """The option without the format, and the format without the option."""
    out = ["--out", str(tmp_path / "out")]
    assert main(["import", "mapped", str(logs), *out]) == 2
    assert "mapped needs --mapping FILE.toml" in capsys.readouterr().err
    assert main(["import", "xl330", str(logs), *out, "--mapping", str(mapping(tmp_path))]) == 2
    assert "belongs to the format mapped" in capsys.readouterr().err


def test_cells_may_be_lists_and_delimiters_semicolons(tmp_path: Path) -> None:
    """A path reaches into a list that stands in a CSV cell; numbers by log are merged."""
    rows = [f'{t};"[0.0, {a}]"' for t, a in zip(TIME, np.sin(TIME), strict=True)]
    two_runs(tmp_path, lambda _: ["time;positions", *rows])
    columns = derived(t="time", theta_d="positions[1]", theta="positions[1]")
    columns += '\n[logs."run_2.*"]\nbench_overrides = {mass = 0.7}'
    head = 'bench = "pendulum"\ndelimiter = ";"\nbench_overrides = {mass = 0.5, length = 0.1}'
    runs = imported(tmp_path, columns, head)
    np.testing.assert_allclose(runs[0].motor_position[:, 0], np.sin(TIME), atol=1e-8)
    numbers = [run.bench_overrides.given for run in runs]
    assert numbers == [{"mass": (0.5,), "length": (0.1,)}, {"mass": (0.7,), "length": (0.1,)}]


def test_json_may_hold_columns_or_lines(tmp_path: Path) -> None:
    """One list per column, or one object per line, gives the same as a list of rows."""
    folder = tmp_path / "logs"
    folder.mkdir()
    table = {"t": TIME.tolist(), "q": np.sin(TIME).tolist()}
    rows = [dict(zip(table, cells, strict=True)) for cells in zip(*table.values(), strict=True)]
    (folder / "run_1.json").write_text(json.dumps(table))
    (folder / "run_2.jsonl").write_text("\n".join(map(json.dumps, rows)))
    columns = derived(t="t", theta_d="q", theta="q")
    for run in imported(tmp_path, columns, 'bench = "servo"\nfiles = "*.json*"'):
        np.testing.assert_allclose(run.motor_position[:, 0], np.sin(TIME), atol=1e-8)


def test_the_mappings_of_the_documentation_are_mappings(tmp_path: Path) -> None:
    """Every mapping file shown in docs/recordings_mapping.md can be read as it stands."""
    page = Path(__file__).resolve().parents[2] / "docs" / "recordings_mapping.md"
    blocks = page.read_text(encoding="utf-8").split("```toml\n")[1:]
    whole = [block.split("```")[0] for block in blocks if "[columns]" in block]
    assert len(whole) == 5
    for block in whole:
        path = tmp_path / "mapping.toml"
        path.write_text(block)
        assert read_mapping(path).bench in ("pendulum", "servo", "lab_finger", "elbow")


LAB = """Zeit [ms];Soll [°];Ist [°];n [rpm];Kraft [N];Notiz
0,0;10,0;9,5;0,0;1,5;an
25,0;10,5;9,6;0,6;1,6;
50,0;11,0;;0,7;1,7;
75,0;11,5;9,9;0,8;NaN;
100,0;12,0;10,1;0,9;1,9;aus
"""
LAB_COLUMNS = """
t = {column = "Zeit [ms]", unit = "ms"}
theta_d = {column = "Soll [°]", unit = "°"}
theta = {column = "Ist [°]", unit = "deg"}
theta_dot = {column = "n [rpm]", unit = "rpm"}
force = {column = "Kraft [N]"}
"""


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Two logs of a lab: semicolons, decimal commas, an empty cell and a NaN."""
    folder = tmp_path / "lab"
    folder.mkdir()
    for name in ("sine_1", "sine_2"):
        (folder / f"{name}.csv").write_text(LAB, encoding="utf-8")
    return folder


def test_a_labs_csv_needs_no_word_about_its_form(lab: Path, tmp_path: Path, capsys) -> None:
    """Delimiter and decimals are guessed and said; rows without a number go, and are counted."""
    assert run_import(lab, mapping(tmp_path, LAB_COLUMNS), tmp_path / "out") == 0
    (run,) = load_dataset(tmp_path / "out").train
    np.testing.assert_allclose(run.time, [0.0, 0.025, 0.1])
    np.testing.assert_allclose(run.motor_position[:, 0], np.deg2rad([9.5, 9.6, 10.1]))
    np.testing.assert_allclose(run.motor_velocity[:, 0], np.array([0.0, 0.6, 0.9]) * np.pi / 30.0)
    assert run.force is not None
    np.testing.assert_allclose(run.force[:, 0], [1.5, 1.6, 1.9])
    said = capsys.readouterr().out
    assert "cells separated by ';' and decimal commas, by its first lines" in said
    assert "2 of 5 rows (Ist [°] 1, Kraft [N] 1 empty cells)" in said


def test_minutes_and_words_of_a_switch_are_read(tmp_path: Path) -> None:
    """A spreadsheet writes a short time as minutes and seconds, and Python a switch as True."""
    rows = [f"01:59.{7 + j}50,{0.1 * j:.1f},{j != 1}" for j in range(3)]
    rows += ["02:00.050,0.3,off", "02:00.150,0.4,on"]
    two_runs(tmp_path, lambda _: ["t,q,motor", *rows])
    run, _ = imported(tmp_path, derived(t="t", theta_d="q", theta="q", enabled="motor"))
    np.testing.assert_allclose(run.time, [119.75, 119.85, 119.95, 120.05, 120.15])
    np.testing.assert_array_equal(run.enabled, [1, 0, 1, 0, 1])


def test_a_command_that_is_logged_where_it_changes_is_held(tmp_path: Path, capsys) -> None:
    """Rows of a sensor and of a command by turns too: 980 rows of 1000 were left out."""
    rows = ["0,,0.0,5", "0.1,1.0,0.1,", "0.2,,0.2,", "0.25,3.0,,", "0.3,,0.3,4", "0.4,,,"]
    two_runs(tmp_path, lambda _: ["t,goal,q,volts", *rows])
    run, _ = imported(tmp_path, derived(t="t", theta_d="goal", theta="q", voltage="volts"))
    assert run.command is not None
    np.testing.assert_array_equal(run.time, [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(run.command[:, 0], [1.0, 1.0, 3.0])
    np.testing.assert_array_equal(run.voltage, [5.0, 5.0, 4.0])
    assert "goal: 3 of 6 cells are empty" in capsys.readouterr().out


@pytest.mark.parametrize("stated", ["", "load_cell_rate = 25"])
def test_a_slow_load_cells_empty_cells_cost_no_rows(stated: str, tmp_path: Path, capsys) -> None:
    """Its readings are joined by lines, but not over a silence, where its rate is stated."""
    rows = [
        f"{0.01 * k:.2f},1,{0.1 * k:.1f},{3 * k if k in (1, 5, 9, 30) else ''}" for k in range(31)
    ]
    two_runs(tmp_path, lambda _: ["t,goal,q,f", *rows])
    columns = derived(t="t", theta_d="goal", theta="q", force="f")
    run, _ = imported(tmp_path, columns, f'bench = "spring_weak"\n{stated}')
    assert run.force is not None
    said = capsys.readouterr().out
    if not stated:
        np.testing.assert_array_equal(run.force[:, 0], [3.0, 15.0, 27.0, 90.0])
        assert "of a slow load cell say load_cell_rate" in said
        return
    assert "f: 27 of 31 cells are empty" in said
    heard = [*range(10), *range(30, 31)]
    np.testing.assert_allclose(run.time, [0.01 * k for k in heard])
    np.testing.assert_allclose(run.force[:, 0], [3.0, *(3.0 * k for k in heard[1:])])


def test_rows_that_are_left_out_leave_their_time(lab: Path, tmp_path: Path) -> None:
    """With a rate in place of a column, a row keeps its own instant."""
    columns = "\n".join(LAB_COLUMNS.splitlines()[2:])
    head = 'bench = "spring_weak"\nrate = 40'
    assert run_import(lab, mapping(tmp_path, columns, head), tmp_path / "out") == 0
    (run,) = load_dataset(tmp_path / "out").train
    np.testing.assert_allclose(run.time, [0.0, 0.025, 0.1])


@pytest.mark.parametrize(("delimiter", "quote"), [(";", ""), ("\t", ""), ("|", ""), (",", '"')])
def test_any_delimiter_goes_with_decimal_commas(delimiter, quote, lab, tmp_path) -> None:
    """Where commas separate cells as well, a spreadsheet quotes the numbers; a mark leads it."""
    for path in lab.glob("*.csv"):
        rows = [[f"{quote}{cell}{quote}" for cell in line.split(";")] for line in LAB.splitlines()]
        path.write_text("\n".join(delimiter.join(row) for row in rows), encoding="utf-8-sig")
    assert run_import(lab, mapping(tmp_path, LAB_COLUMNS), tmp_path / "out") == 0
    (run,) = load_dataset(tmp_path / "out").train
    np.testing.assert_allclose(run.motor_position[:, 0], np.deg2rad([9.5, 9.6, 10.1]))


@pytest.mark.parametrize(
    ("head", "columns", "said"),
    [
        ("", LAB_COLUMNS.replace("Ist [°]", "Ist"), "no column named 'Ist'; there are Zeit [ms]"),
        ("", LAB_COLUMNS.replace("Kraft [N]", "Notiz"), "Notiz must be a number; line 2 has 'an'"),
        ('decimal = "."', LAB_COLUMNS, "must be a number; line 2 has '0,0'"),
        ('decimal = "x"', LAB_COLUMNS, "decimal must be '.' or ','"),
        ('delimiter = ","', LAB_COLUMNS, "no column named 'Zeit [ms]'"),
    ],
)
def test_what_cannot_be_guessed_is_said(head, columns, said, lab, tmp_path, capsys) -> None:
    """A missing column is called that, a word is no number, and what is stated wins."""
    path = mapping(tmp_path, columns, f'bench = "spring_weak"\n{head}')
    assert run_import(lab, path, tmp_path / "out") == 2
    assert said in capsys.readouterr().err


def test_an_object_a_line_is_found_again_by_its_line(lab: Path, tmp_path: Path, capsys) -> None:
    """A logger that is stopped cuts its last object; empty lines count."""
    rows = [{"Zeit [ms]": 25 * k, "Soll [°]": 1, "Ist [°]": k, "n [rpm]": 0} for k in range(4)]
    told = {"a": ("", "must be a number; line 6 has 'a'"), "3": ("{", "JSON: Extra data")}
    for angle, (cut, said) in told.items():
        lines = ["", *map(json.dumps, rows), json.dumps({**rows[3], "Ist [°]": angle}) + cut]
        (lab / "run_1.jsonl").write_text("\n".join(lines))
        head = 'bench = "spring_weak"\nfiles = "*.jsonl"'
        path = mapping(tmp_path, LAB_COLUMNS.replace("force = ", "# force = "), head)
        assert run_import(lab, path, tmp_path / "out") == 2
        assert said in (err := capsys.readouterr().err)
        assert "line 6 " in err


@pytest.mark.parametrize(
    ("spoilt", "said"),
    [
        ("100,0;12,0;10,1;0,9;", "t must strictly increase; line 10 is 0.100000 s after 0.100000"),
        ("110,0;12,0;1e9;0,9;1,9", "theta must be in radians; line 10 (t = 0.11 s) is 1.7453"),
        ("110,0;12,0;ab;0,9;1,9", "must be a number; line 10 has 'ab'"),
    ],
)
def test_an_error_names_the_line_of_the_file(spoilt, said, lab, tmp_path, capsys) -> None:
    """Comments, a header, units, rows without a number and empty lines count as an editor does."""
    columns = LAB_COLUMNS.replace("force = ", "# force = ")
    head, *rows = LAB.splitlines()
    lines = ["# bench 3", head, "ms;deg;deg;rpm;N;-", *rows[:3], "", *rows[3:], spoilt]
    (lab / "sine_1.csv").write_text("\n".join(lines))
    assert run_import(lab, mapping(tmp_path, columns), tmp_path / "out") == 2
    told = capsys.readouterr().err
    assert said in told
    assert "sine_1.csv: sine_1" not in told


def test_comments_a_stated_header_and_fewer_rows(tmp_path: Path) -> None:
    """Lines of a comment are passed over, names are stated, and rows are means of many.

    A sine of 0.5 Hz loses 0.01 % of its size to a Gaussian of 5 ms; an encoder of 10 mrad a count
    loses its steps.
    """
    time = np.arange(4000) / 1000.0
    angle = 0.5 * np.sin(np.pi * time)
    rows = rows_of(time, np.round(angle / 0.01) * 0.01, -0.1 + 0.0 * time)
    logs = two_runs(tmp_path, lambda _: ["% of the bench", "% t, angle", *rows])
    head = 'bench = "spring_weak"\ncomment = "%"\nheader = ["s", "angle", "load"]\nresample = 100\n'
    columns = (
        derived(t="s", theta="angle")
        + """
force = {column = "angle", scale = 2.0}
joint_angle = {column = "angle", unit = "rad"}
joint_load = {column = "load", unit = "mN m"}
"""
    )
    run, _ = imported(tmp_path, columns, head)
    assert run.driven_by == "path"
    assert np.diff(run.time) == pytest.approx(np.full(len(run.time) - 1, 0.01))
    assert run.compared_angle == pytest.approx(0.5 * np.sin(np.pi * run.time), abs=3e-3)
    assert run.joint_load == pytest.approx(np.full(len(run.time), -1e-4))
    columns = columns.split("joint_angle")[0] + '[model]\nkind = "measured_path"\n'
    assert run_import(logs, mapping(tmp_path, columns, head), tmp_path / "alone") == 0
    alone = load_dataset(tmp_path / "alone").train[0]
    assert alone.driven_by == "path"
    assert not np.any(alone.joint_load)
    assert run.force is not None
    assert run.force[:, 0] == pytest.approx(2.0 * run.motor_position[:, 0])


@pytest.mark.parametrize(
    ("torque", "model", "told"),
    [
        ("torque [mN m]", LED, ""),
        ("turned [mN m]", LED, "force and theta count in opposite directions"),
        ("torque [mN m]", "", 'kind = "measured_path" under [model]'),
        ("torque [N m]", LED, "its unit is 'N m' by the file"),
        ("amps", LED, "scale = N m per A"),
    ],
)
def test_angle_and_torque_alone_are_told_what_they_are(
    tmp_path: Path, capsys, torque: str, model: str, told: str
) -> None:
    """A torque that takes work, an actuator that was forgotten, another unit, and a current."""
    time = np.arange(400) / 50.0

    def lines(k: int) -> list[str]:
        angle, speed = np.sin((k + 1.0) * time), (k + 1.0) * np.cos((k + 1.0) * time)
        force = np.sin(angle) + 0.3 * np.sign(speed) + 0.1 * speed
        head = f"s,angle,{torque.replace('turned', 'torque')},turned [mN m]"
        return [head, *rows_of(time, angle, force, -force)]

    unit = "A" if torque == "amps" else "mN m"
    columns = derived(t="s", theta="angle")
    columns += f'\nforce = {{column = "{torque}", unit = "{unit}"}}\n{model}'
    path = mapping(tmp_path, columns, 'bench = "pendulum"')
    run_import(two_runs(tmp_path, lines), path, tmp_path / "out")
    said = "".join(capsys.readouterr())
    assert told in said
    assert ("defect" in said) == (told.startswith(("force and", "its unit")))


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("resample = 1000", "resample makes fewer rows; 1000 Hz is asked for"),
        ("resample = 1", "resample needs more rows; there are 200"),
        ("header = 3", "header must be a list of names; it is 3"),
        ("comment = 3", "comment must be text; it is 3"),
    ],
)
def test_a_form_that_cannot_be_is_refused(logs, tmp_path, head, message, capsys) -> None:
    """One line says what was expected and what came."""
    path = mapping(tmp_path, head=f'bench = "spring_weak"\n{head}')
    assert run_import(logs, path, tmp_path / "out") == 2
    assert message in capsys.readouterr().err


def several_servos(folder: Path, wrong: slice = slice(0)) -> tuple[Path, np.ndarray]:
    """Write two logs of three servos in one file each; return their folder and all angles.

    In wrong rows the second one shows the third one's angle.
    """
    angles = np.stack([(k + 1) * 0.1 * np.sin((k + 1) * TIME) for k in range(3)], axis=1)
    angles[wrong, 1] = angles[wrong, 2]
    heads = [f"{what}_{k}" for what in ("goal", "angle", "amps") for k in range(3)]
    rows = rows_of(TIME, 1.1 * angles, angles, np.arange(3) + 0.0 * angles)
    return two_runs(folder, lambda _: [",".join(["t", *heads]), *rows]), angles


def of_servos(count: int) -> str:
    """Return the columns of several servos of one file."""
    rows = ['t = {column = "t"}', 'theta_dot = {derive = "theta"}']
    for k in range(count):
        rows.append(f'theta_d_{k} = {{column = "goal_{k}"}}')
        rows.append(f'theta_{k} = {{column = "angle_{k}", sign = -1}}')
        rows.append(f'current_{k} = {{column = "amps_{k}"}}')
    return "\n".join(rows)


def test_a_bench_of_two_strings_comes_from_one_file(tmp_path: Path) -> None:
    """Columns with the number of a servo are those of one recording, as in our own files."""
    _, angles = several_servos(tmp_path)
    run, _ = imported(tmp_path, of_servos(2), 'bench = "finger_antagonist"')
    assert run.command is not None
    np.testing.assert_allclose(run.command, 1.1 * angles[:, :2])
    np.testing.assert_allclose(run.motor_position, -angles[:, :2])
    slope = -0.1 * np.cos(TIME)
    np.testing.assert_allclose(run.motor_velocity[:, 0], slope, atol=1e-3)


@pytest.mark.parametrize("joints", [("yaw", "shoulder", "elbow"), ()])
def test_the_joints_of_an_arm_come_from_one_file(joints: tuple[str, ...], tmp_path: Path) -> None:
    """Each becomes a dataset in a folder of its name, as `diagnose` takes an arm."""
    folder, angles = several_servos(tmp_path)
    head = f'bench = "servo"\njoints = {list(joints)}'
    assert run_import(folder, mapping(tmp_path, of_servos(3), head), tmp_path / "arm") == 0
    for k, joint in enumerate(joints or ("servo_0", "servo_1", "servo_2")):
        (run,) = load_dataset(tmp_path / "arm" / joint).train
        assert run.command is not None
        assert run.current is not None
        np.testing.assert_allclose(run.command[:, 0], 1.1 * angles[:, k])
        np.testing.assert_allclose(run.motor_position[:, 0], -angles[:, k])
        np.testing.assert_allclose(run.current, k)


def test_a_neighbours_value_is_found_before_joints_part(tmp_path: Path, capsys) -> None:
    """In every fifth row: the log of the joint alone has no motion to judge them by."""
    folder, _ = several_servos(tmp_path, slice(7, None, 5))
    head = 'bench = "servo"\njoints = ["yaw", "shoulder", "elbow"]'
    path = mapping(tmp_path, of_servos(3), head)
    run_import(folder, path, tmp_path / "arm")
    said = capsys.readouterr().out
    assert "where elbow is" in said
    assert run_import(folder, path, tmp_path / "mended", "--mend") == 0
    (run,) = load_dataset(tmp_path / "mended" / "shoulder").train
    kept = np.isin(TIME, run.time)
    np.testing.assert_allclose(run.motor_position[:, 0], -0.2 * np.sin(2.0 * run.time), atol=1e-6)
    assert kept.mean() > 0.7


@pytest.mark.parametrize(
    ("columns", "head", "words"),
    [
        (of_servos(3), 'joints = ["yaw", "elbow"]', "one per servo: the columns of run_1.csv are"),
        (of_servos(2).replace("goal_1", "goal"), "", "no column named 'goal'"),
        (of_servos(2) + '\ntheta_dot_1 = {column = "amps_1"}', "", "derived for all of them"),
        ('theta_0 = {topic = "/state", field = "position"}', "", "joints lists their names"),
    ],
)
def test_servos_that_do_not_fit_together_are_refused(
    columns: str, head: str, words: str, tmp_path: Path, capsys
) -> None:
    """One line names the column."""
    folder, _ = several_servos(tmp_path)
    path = mapping(tmp_path, columns, f'bench = "servo"\n{head}')
    assert run_import(folder, path, tmp_path / "out") == 2
    assert words in capsys.readouterr().err


POUND, STANDARD = 0.45359237, 9.80665  # kg, m/s2: by definition
IN_OURS = {
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0,
    "d": 86400.0,
    "rad": 1.0, "mrad": 1e-3, "deg": math.radians(1.0), "degrees": math.radians(1.0),
    "°": math.radians(1.0), "turn": math.tau, "rev": math.tau,
    "rad/s": 1.0, "mrad/s": 1e-3, "deg/s": math.radians(1.0), "°/s": math.radians(1.0),
    "rev/min": math.tau / 60.0, "rpm": math.tau / 60.0, "rev/s": math.tau,
    "N": 1.0, "mN": 1e-3, "kN": 1e3, "g": 1e-3 * STANDARD, "gf": 1e-3 * STANDARD,
    "kg": STANDARD, "kgf": STANDARD, "lbf": POUND * STANDARD,
    "N m": 1.0, "Nm": 1.0, "mN m": 1e-3, "mNm": 1e-3, "kgf cm": 1e-2 * STANDARD,
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "A": 1.0, "mA": 1e-3, "V": 1.0, "mV": 1e-3,
    "degC": 1.0, "°C": 1.0, "1": 1.0,
}  # fmt: skip
"""Units by their definitions."""


@pytest.mark.parametrize("column", UNITS)
def test_a_unit_is_as_large_as_it_is_defined(column: str) -> None:
    """Every unit of every column; a new one is defined here a second time."""
    for unit, size in UNITS[column].items():
        assert size == pytest.approx(IN_OURS[unit], rel=1e-7), unit
