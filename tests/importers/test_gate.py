"""An import tells what is wrong with logs, decides where they start, and ends with what to type."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.data.recording import Array, BenchOverrides
from tendon_newton.diagnosis.accounts.checked_data import findings_of
from tendon_newton.mechanisms.bench_facts import held_excursions
from tendon_newton.workflows.importing import spool_radius
from tests.bad_input.damage import refusal
from tests.proposed import proposed

GAIN = 4.2  # N/rad
TIME = np.arange(400) / 80.0
STEPS = 1.5 + 0.5 * np.sign(np.sin(2.0 * TIME + 0.01))


@dataclass(kw_only=True)
class Logs:
    """What a lab writes of a finger: t, goal, q and f of each run, and a mapping."""

    runs: list[dict[str, Array]] = field(default_factory=list)
    bench: str = "finger"
    mapped: dict[str, str] = field(
        default_factory=lambda: {"t": "t", "theta_d": "goal", "theta": "q", "force": "f"}
    )
    tail: str = '[model]\nkind = "ideal"\ngain = 4.2'

    def write(self, folder: Path) -> list[str]:
        """Write logs and mapping; return the words that import them."""
        (folder / "logs").mkdir()
        for number, run in enumerate(self.runs):
            rows = np.column_stack(list(run.values()))
            path = folder / "logs" / f"run_{number}.csv"
            np.savetxt(path, rows, delimiter=",", header=",".join(run), comments="")
        columns = [f'{ours} = {{column = "{theirs}"}}' for ours, theirs in self.mapped.items()]
        lines = [f'bench = "{self.bench}"', "[columns]", *columns, 'theta_dot = {derive = "theta"}']
        (folder / "mapping.toml").write_text("\n".join([*lines, self.tail]))
        words = ["--mapping", str(folder / "mapping.toml"), "--out", str(folder / "out")]
        return ["import", "mapped", str(folder / "logs"), *words]


def run(seed: int, away: float = 0.0, scale: float = 1.0, rests: int = 60) -> dict[str, Array]:
    """Return a run of steps: a lag of 50 ms towards the friction-free rest of each command."""
    held = held_excursions("finger", BenchOverrides())
    assert held is not None
    rest, tension = held[0] / spool_radius("finger"), held[1]
    asked = scale * np.array([np.interp(0.0, tension - GAIN * (c - rest), rest) for c in STEPS])
    theta = np.full_like(asked, asked[0] + away)
    for k in range(rests, asked.size):
        theta[k] = theta[k - 1] + (asked[k - 4] - theta[k - 1]) / 4.0
    noise = 1e-4 * np.random.default_rng(seed).standard_normal((2, asked.size))
    force = GAIN * (STEPS - theta)
    return {"t": TIME, "goal": STEPS, "q": theta + noise[0], "f": force + noise[1]}


@pytest.fixture
def logs() -> Logs:
    """Two sound runs that begin at rest."""
    return Logs(runs=[run(0), run(1)])


def said(logs: Logs, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Import and return what was printed."""
    assert main(logs.write(folder)) == 0
    return capsys.readouterr().out


def test_sound_logs_are_held_out_by_recording_and_the_next_command_is_told(
    logs: Logs, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing is wrong; one run is held out, said so; the last line can be typed as it is."""
    text = said(logs, tmp_path, capsys)
    assert "held out as test, since --test names none: run_1.csv" in text
    assert "defect" not in text
    assert "caution" not in text
    out = tmp_path / "out"
    command = f"  tendon-newton diagnose {out} --out {out}_diagnosis"
    assert text.splitlines()[-2:] == ["next:", command]
    assert [words[0] for words in proposed(text)] == ["diagnose"]
    loaded = load_dataset(out)
    assert [len(loaded.train), len(loaded.test)] == [1, 1]


def test_one_run_alone_is_cut_by_the_diagnosis(logs, tmp_path, capsys) -> None:
    """There is no second run to hold out: the command that is told cuts this one."""
    del logs.runs[1]
    assert said(logs, tmp_path, capsys).splitlines()[-1].endswith("_diagnosis --hold-out 0.3")


@pytest.mark.parametrize(
    ("away", "rests", "start", "why"),
    [
        (0.12, 60, "equilibrium", "rests under its first command"),
        (0.3, 4, "first_row", "begins at rest with a jump of the command, by -"),
        (0.3, 0, "first_row", "begins in motion: what was commanded before is not known"),
    ],
)
def test_the_first_rows_say_where_a_simulation_starts(
    away, rests, start, why, tmp_path, capsys
) -> None:
    """A rest wherever friction holds it, a jump and a motion are said."""
    runs = [run(seed, away, rests=rests) for seed in range(2)]
    text = said(Logs(runs=runs), tmp_path, capsys)
    assert load_dataset(tmp_path / "out").train[0].start == start
    assert why in text
    assert f'(start = "{start}")' in text


def test_a_brief_rest_does_not_show_where_friction_holds(tmp_path, capsys) -> None:
    """The command jumps after 0.2 s: the first row alone says where the servo stands."""
    brief = [{name: rows[110:] for name, rows in run(seed).items()} for seed in range(2)]
    text = said(Logs(runs=brief), tmp_path, capsys)
    assert load_dataset(tmp_path / "out").train[0].start == "first_row"
    assert "rests in the first row, and where friction lets it rest is not known" in text


def test_a_start_that_is_stated_stays(logs: Logs, tmp_path: Path) -> None:
    """Only what the mapping leaves open is decided."""
    words = logs.write(tmp_path)
    path = tmp_path / "mapping.toml"
    path.write_text('start = "first_row"\n' + path.read_text())
    assert main(words) == 0
    assert load_dataset(tmp_path / "out").train[0].start == "first_row"


def short(logs: Logs) -> None:
    """Keep a tenth of a second."""
    logs.runs = [{name: values[:9] for name, values in run.items()} for run in logs.runs]


def exchanged(logs: Logs) -> None:
    """Name the angle where the command belongs."""
    logs.mapped |= {"theta_d": "q", "theta": "goal"}


def pushing(logs: Logs) -> None:
    """Turn the force around."""
    for log in logs.runs:
        log["f"] = -log["f"]


def in_degrees(logs: Logs) -> None:
    """Write angle and command in degrees, of a motion so small that radians could be as large."""
    for log in logs.runs:
        log |= {name: np.rad2deg(log[name]) / 2.0 for name in ("q", "goal")}


def half_in_degrees(logs: Logs) -> None:
    """Write the angle alone in degrees."""
    for log in logs.runs:
        log["q"] = np.rad2deg(log["q"])


def degrees_of_radians(logs: Logs) -> None:
    """Take radians for degrees."""
    for log in logs.runs:
        log |= {name: np.deg2rad(log[name]) for name in ("q", "goal")}


def turned(logs: Logs) -> None:
    """Count angle and command the other way round."""
    for log in logs.runs:
        log |= {name: -log[name] for name in ("q", "goal")}


def zero_off(logs: Logs) -> None:
    """Read the angle, and not its command, 0.3 rad too great."""
    for log in logs.runs:
        log["q"] = log["q"] + 0.3


def in_kilograms(logs: Logs) -> None:
    """Write the force in kgf."""
    for log in logs.runs:
        log["f"] = log["f"] / 9.80665


def amplified(logs: Logs) -> None:
    """Read the cell with ten times its gain, on a servo that is said to pull as much."""
    logs.tail = logs.tail.replace("4.2", "42")
    for log in logs.runs:
        log["f"] = 10.0 * log["f"]


def of_another_time(logs: Logs) -> None:
    """Log the force by a clock that is half a period off."""
    for log in logs.runs:
        log["f"] = np.roll(log["f"], 126)


def tared_under_load(logs: Logs) -> None:
    """Take a string's mean pull for nothing."""
    for log in logs.runs:
        log["f"] = log["f"] - log["f"].mean()


def slack_under_load(logs: Logs) -> None:
    """Let the string go for the last second, with the zero of the cell 2 N off."""
    for log in logs.runs:
        log["f"] = log["f"] + 2.0
        log["q"][-80:], log["goal"][-80:], log["f"][-80:] = -0.1, -0.1, 2.0


def contradicting(logs: Logs) -> None:
    """Twenty-one repeats of one command, all but the first of a worn servo."""
    logs.runs = [run(0), *(run(seed, scale=0.8) for seed in range(1, 21))]


@pytest.mark.parametrize(
    ("spoil", "evidence", "mend"),
    [
        (short, "lasts 0.1 s (9 rows)", "record 10 s or more"),
        (exchanged, "ahead of theta_d", "exchange them in the mapping"),
        (pushing, "N on average, below zero in", "sign = -1"),
        (in_degrees, "and the whole range of finger is", 'unit = "deg"'),
        (half_in_degrees, "times as far as theta_d", 'theta is in degrees: say unit = "deg"'),
        (degrees_of_radians, "and the whole range of finger is", "and taken for degrees"),
        (turned, "where a string of finger is slack, and pulls", "turn theta (sign = -1"),
        (zero_off, "the force is zero where theta_d - theta is -0.30 rad", "offset = -0.300"),
        (in_kilograms, "where springs and gravity of finger take", 'unit = "kgf"'),
        (amplified, "where springs and gravity of finger take", "the scale of its cell"),
        (of_another_time, "where springs and gravity of finger take more", "its clock differs"),
        (tared_under_load, "lie below zero, down to", "tare it without a string"),
        (slack_under_load, "rad and the string is slack", "tare it without a string"),
        (contradicting, "20 runs repeat a command and answer it otherwise", "leave one out"),
    ],
)
def test_a_mistake_is_told_once_with_its_mend(
    spoil, evidence: str, mend: str, logs: Logs, tmp_path: Path, capsys
) -> None:
    """One line says what to do, below it the evidence of four runs; no spring is blamed for it."""
    spoil(logs)
    text = said(logs, tmp_path, capsys)
    (line,) = (line for line in text.splitlines() if mend in line)
    assert line.startswith(("defect, ", "caution, "))
    for blamed in ("springs and gravity", "the string is slack"):
        assert (blamed in text) == (blamed in evidence)
    assert 1 <= sum(evidence in line for line in text.splitlines()) <= 4
    assert ("\nmend the defects, then:\n" in text) == (
        spoil not in (contradicting, of_another_time, zero_off)
    )


def test_without_a_model_the_assets_spool_is_taken(logs: Logs, tmp_path: Path, capsys) -> None:
    """A pendulum's shaft counts as 1 m, and no finger's 12.5 mm; a servo made up is told."""
    logs.bench, logs.tail = "pendulum", ""
    assert "caution, model: causes are named beside this servo" in said(logs, tmp_path, capsys)
    assert load_model(tmp_path / "out" / "model.toml").actuator.values["spool_radius"] == 1.0


@pytest.mark.parametrize(("fit", "code"), [("", 2), ("[spool_radius]", 0)])
def test_two_files_that_say_a_radius_differently_are_refused(
    fit: str, code: int, logs: Logs, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Unless it is to be fitted, when the number is where the search begins."""
    logs.tail = '[model]\nkind = "ideal"\ngain = 4.2\nspool_radius = 0.02'
    words = logs.write(tmp_path)
    path = tmp_path / "mapping.toml"
    path.write_text(('fit = ["spool_radius"]\n' if fit else "") + path.read_text())
    assert main(words) == code
    if code:
        (line,) = capsys.readouterr().err.splitlines()
        assert "that of the asset 'finger', 0.0125 m; [model] says 0.02 m" in line


def test_an_unknown_bench_names_the_folders_variable(logs, tmp_path, capsys, monkeypatch) -> None:
    """And where the folder lies at hand, the very value that makes it known."""
    logs.bench = "lab_finger"
    words = logs.write(tmp_path)
    monkeypatch.chdir(tmp_path)
    said = refusal(words, capsys)
    assert "your own are looked for in the folders in TENDON_NEWTON_ASSETS" in said
    assert not (tmp_path / "out").exists()
    (tmp_path / "lab_finger").mkdir()
    (tmp_path / "lab_finger" / "lab_finger.usda").write_text("#usda 1.0\n")
    assert f"./lab_finger is found with TENDON_NEWTON_ASSETS={tmp_path}" in refusal(words, capsys)


def test_a_force_that_the_asset_does_not_allow_is_a_defect(tmp_path, capsys) -> None:
    """A servo that pulls with ten times as much would end at 21 N in every simulation."""
    strong = {**run(0), "f": 10.0 * run(0)["f"]}
    assert main(Logs(runs=[strong, run(1)]).write(tmp_path)) == 0
    said = capsys.readouterr().out
    assert "by its asset" in said
    assert "raise tendon:forceLimit there" in said
    assert "mend the defects, then:" in said


def test_a_cart_beyond_its_rail_is_a_defect(tmp_path, capsys, monkeypatch) -> None:
    """`asset new` puts a cart's zero into the middle of 1 m; a log with its zero at an end says."""
    assert main(["asset", "new", "gate_cart", "--kind", "slider", "--folder", str(tmp_path)]) == 0
    monkeypatch.setenv("TENDON_NEWTON_ASSETS", str(tmp_path))
    fits = {**run(0), "q": 0.4 * np.sin(TIME)}
    away = {**run(1), "q": 0.5 + 0.4 * np.sin(TIME)}
    logs = Logs(runs=[fits, away], bench="gate_cart", tail='[model]\nkind = "ideal"\ngain = 9.0\n')
    assert main(logs.write(tmp_path)) == 0
    said = capsys.readouterr().out
    assert "run_1.csv  lies up to 0.4 m beyond the range of gate_cart, -0.5 to 0.5 m" in said
    assert "run_0.csv  lies" not in said


def test_a_pendulum_that_hangs_at_half_a_turn_is_told(tmp_path, capsys) -> None:
    """Counts of 4096 a turn without their offset: the answer was "unexplained", without a word."""
    down, up = ({**run(k), "q": angle + np.sin(TIME)} for k, angle in enumerate((0.0, np.pi)))
    assert main(Logs(runs=[down, up], bench="pendulum").write(tmp_path)) == 0
    said = capsys.readouterr().out
    assert "offset = -3.14159 in the mapping" in said
    assert "run_1.csv  lies from 2.14 to 4.14 rad, and the mass of pendulum hangs" in said
    assert "run_0.csv  lies" not in said


def test_a_string_wound_in_beyond_the_joints_is_told_by_every_door(tmp_path, capsys) -> None:
    """The packaged finger is closed at 22 mm, 1.76 rad of its motor; this one went on to 2 rad."""
    q = run(0)["q"]
    far = {**run(0), "q": 2.0 * (q - q.min()) / np.ptp(q)}
    assert main(Logs(runs=[far, run(1)]).write(tmp_path)) == 0
    said = capsys.readouterr().out
    assert "run_0.csv  winds in 25 mm, and all joints of finger are at their ends at" in said
    assert "--range of asset new" in said
    assert "run_1.csv  winds" not in said
    main(["doctor", str(tmp_path / "out")])
    assert "run_0.csv  winds in 25 mm" in capsys.readouterr().out
    data = load_dataset(tmp_path / "out", require_train=False, require_test=False)
    found = [f for f in findings_of(data.train, data.test) if "winds in" in f.evidence]
    assert [(f.severity, f.recording) for f in found] == [("caution", "run_0.csv")]
