"""Each check finds its defect and is silent on sound data."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.checks.finding import Examined, Finding, findings_text
from tendon_newton.data.checks.following import play
from tendon_newton.data.checks.lint import lint_dataset, lint_recording
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.lost_signs import lost_sign
from tendon_newton.data.recording import Recording

ROWS = 800
TIME = np.arange(ROWS) / 80.0


def log(**changes: Any) -> Recording:
    """A sound log: 10 s of smooth motion with a little noise on the force."""
    theta = np.sin(3.0 * TIME)[:, None]
    noise = 0.01 * np.sin(977.0 * TIME)[:, None]
    fields: dict[str, Any] = {
        "name": "run.csv",
        "bench": "finger",
        "time": TIME,
        "command": theta + 0.5,
        "motor_position": theta,
        "motor_velocity": 3.0 * np.cos(3.0 * TIME)[:, None],
        "force": 2.1 + noise,
    }
    return Recording(**(fields | changes))


def only(findings: tuple[Finding, ...]) -> Finding:
    """The one finding that there is."""
    (finding,) = findings
    return finding


def test_sound_data_gives_no_finding() -> None:
    """Silence on data without a defect."""
    assert lint_recording(log(), {"force": 21.0}) == ()


def test_a_gap_is_found_where_it_is() -> None:
    """300 ms without rows are named with their length and place."""
    time = np.where(TIME >= 5.0, TIME + 0.3, TIME)
    finding = only(lint_recording(log(time=time)))
    assert finding.channel == "t"
    assert finding.evidence.startswith("1 gaps; the largest lasts 312 ms after t = 4.987 s")


@pytest.mark.parametrize("lag", [0.02, 0.05, -0.03])
def test_a_lag_of_the_velocity_is_measured(lag: float) -> None:
    """The delay behind the slope of the position is found within 1 ms, its resolution."""
    velocity = 3.0 * np.cos(3.0 * (TIME - lag))[:, None]
    finding = only(lint_recording(log(motor_velocity=velocity)))
    assert finding.channel == "theta_dot"
    assert abs(int(finding.evidence.split()[0]) - 1e3 * abs(lag)) <= 1
    assert ("ahead of" in finding.evidence) == (lag < 0.0)


@pytest.mark.parametrize("scale", [57.29578, 1.0 / 57.29578, 0.2])
def test_a_joint_in_another_unit_is_told_by_its_own_column(scale: float) -> None:
    """Of two joints the second is; the first was blamed, and failed in a dataset's examination."""
    own = np.sin(3.0 * TIME)
    theta = np.stack([np.cos(2.0 * TIME), scale * own], axis=1)
    command = np.stack([np.cos(2.0 * TIME), own], axis=1)
    seen = log(bench="servo", motor_position=theta, command=command, force=None,
               motor_velocity=np.gradient(theta, TIME, axis=0))  # fmt: skip
    told = [one for one in lint_recording(seen) if one.check == "degrees"]
    assert told
    assert all(one.channel.endswith("_1") for one in told)


@pytest.mark.parametrize(("pause", "said"), [(0.0, ["frozen read"]), (20.0, ["clock"])])
def test_a_rest_before_a_pause_is_no_frozen_reading(pause: float, said: list[str]) -> None:
    """One file of several trials: each begins elsewhere, some time after the last one's rest."""
    theta = 0.5 * np.sin(3.0 * TIME)
    theta[TIME > 5.0] += 1.0
    theta[(TIME > 4.5) & (TIME <= 5.0)] = theta[TIME <= 4.5][-1]
    time = TIME + pause * (TIME > 5.0)
    slope = np.where(np.diff(theta, append=theta[-1]) == 0.0, 0.0, 1.5 * np.cos(3.0 * TIME))
    moving = {"motor_position": theta, "command": theta + 0.5, "motor_velocity": slope}
    seen = lint_recording(
        log(time=time, force=None, **{name: rows[:, None] for name, rows in moving.items()})
    )
    assert [one.check for one in seen if one.check in ("frozen read", "clock")] == said


def test_a_log_of_more_rows_than_readings_is_slow_and_not_frozen() -> None:
    """A kilohertz of rows hold a hundred commands and angles a second, ten times each."""
    goal, theta = 0.7 * np.sin(9.4 * np.arange(1000) / 100.0), np.zeros(1000)
    for k in range(5, 1000):
        theta[k] = theta[k - 1] + 0.2 * (goal[k - 5] - theta[k - 1])
    goal, theta = (np.repeat(rows, 10)[:, None] for rows in (goal, np.round(theta, 4)))
    time = np.arange(10_000) / 1000.0
    speed = np.gradient(theta, time, axis=0)
    seen = log(time=time, command=goal, motor_position=theta, motor_velocity=speed, force=None)
    assert only(lint_recording(seen)).check == "slow read"


def test_a_command_that_steps_by_a_turn_is_no_seam() -> None:
    """At the end of a run its shaft has not gone along yet: the mend spoilt the command."""
    goal, theta = np.where(TIME < 9.9, 0.2, 6.1), 0.2 + 0.1 * np.sin(3.0 * TIME)
    rows = {"command": goal, "motor_position": theta, "motor_velocity": np.gradient(theta, TIME)}
    seen = lint_recording(log(force=None, **{name: row[:, None] for name, row in rows.items()}))
    assert "seam" not in {one.check for one in seen}


def test_a_speed_that_is_the_slope_of_a_wrapped_angle_is_no_second_defect() -> None:
    """The seam is told, and what it does to the slope goes with its mend."""
    theta = 2.0 * np.sin(3.0 * TIME) + 2.5 * np.sin(0.4 * TIME)
    wrapped = np.mod(theta, 2.0 * np.pi)
    speed = np.gradient(wrapped, TIME)
    rows = {"command": theta + 0.01, "motor_position": wrapped, "motor_velocity": speed}
    seen = log(force=None, **{name: values[:, None] for name, values in rows.items()})
    assert only(lint_recording(seen)).check == "seam"


def test_rounding_of_a_joint_that_rests_is_no_unit() -> None:
    """Means of equal numbers are off by 1e-17: "moves 4.0 times as far" was made of that."""
    for theta, command in np.random.default_rng(0).uniform(-0.5, 0.5, (50, 2)):
        rests = {"motor_position": theta, "command": command, "motor_velocity": 0.0}
        rows = {name: np.full((len(TIME), 1), value) for name, value in rests.items()}
        seen = lint_recording(log(bench="servo", force=None, **rows))
        assert not [one for one in seen if one.check == "degrees"]


@pytest.mark.parametrize("most", [-1, 0, 1, 2])
def test_few_values_on_one_side_of_zero_do_not_hide_an_unsigned_register(most: int) -> None:
    """A load that pulls one way alone, near zero and beyond; -1 stands for its mirror."""
    counts = np.minimum(abs(most), np.round(300.0 * np.sin(3.0 * TIME) - 290.0))
    signed = -counts if most < 0 else counts
    signed[500:] *= most < 1  # switched off, from far away
    duty = np.where(signed < 0.0, signed + 65536.0, signed)
    finding = only(lint_recording(log(extra={"duty": duty}), {"duty": np.inf}))
    assert finding.consequence.endswith("read as unsigned: subtract 65536")


def test_a_failed_read_is_no_lost_sign() -> None:
    """All bits set amid a place of 4096 counts is no step through zero."""
    counts = np.round(1500.0 + 400.0 * np.sin(3.0 * TIME))
    counts[100::50] = 65535.0
    assert lost_sign(counts) is None


def test_a_signed_register_and_a_coarse_one_are_left_alone() -> None:
    """Grids alone are no defect."""
    counts = np.round(400.0 * np.sin(3.0 * TIME))
    assert lint_recording(log(current=0.001 * counts)) == ()
    assert lint_recording(log(extra={"switch": 65535.0 * (counts > 0.0)})) == ()


def test_single_rows_that_were_not_read_are_counted() -> None:
    """Three rows at -pi stand alone; a fast motion that passes there does not."""
    theta = np.sin(3.0 * TIME)
    theta[[100, 300, 500]] = -3.1401
    finding = only(lint_recording(log(motor_position=theta[:, None])))
    assert (finding.channel, finding.severity) == ("theta", "defect")
    assert finding.evidence.startswith(
        "3 of 800 rows (0.38 %, t = 1.25, 3.75, 6.25 s) lie beside the motion, at -3.14"
    )
    fast = 4.0 * np.sin(6.0 * TIME)
    swinging = log(
        command=fast[:, None] + 0.5,
        motor_position=fast[:, None],
        motor_velocity=24.0 * np.cos(6.0 * TIME)[:, None],
    )
    assert lint_recording(swinging) == ()


@pytest.mark.parametrize("read", [0.0, 25.0])
def test_a_supply_that_was_not_read_is_a_defect(read: float) -> None:
    """One row of 0 or 25 V among 12 V; a sag to 9 V is none."""
    supply = np.full(ROWS, 12.0)
    supply[400:420] = 9.0
    assert lint_recording(log(voltage=supply)) == ()
    supply[40] = read
    found = [f for f in lint_recording(log(voltage=supply)) if f.severity == "defect"]
    assert only(tuple(found)).evidence.startswith("1 of 800 rows (0.12 %, t = 0.5 s) say")


def test_a_motor_that_is_off_is_noted() -> None:
    """Two segments, the first with its times."""
    enabled = np.ones(ROWS, dtype=bool)
    enabled[80:160] = enabled[400:480] = False
    finding = only(lint_recording(log(enabled=enabled)))
    assert (finding.channel, finding.severity) == ("enabled", "note")
    assert "off in 160 of 800 rows, 2 times, first from t = 1.00 s to 1.99 s" in finding.evidence


@pytest.mark.parametrize(("ratio", "named"), [(345.0, True), (60.0 / (2.0 * np.pi), False)])
def test_a_speed_that_was_divided_by_its_gear_twice_is_named(ratio: float, named: bool) -> None:
    """A gear ratio of 345 is named; revolutions a minute are another unit alone."""
    velocity = 3.0 * np.cos(3.0 * TIME)[:, None] / ratio
    finding = only(lint_recording(log(motor_velocity=velocity)))
    assert finding.severity == "defect"
    assert ("gear ratio of 345" in finding.consequence) == named


@pytest.mark.parametrize(("noise", "told"), [(0.01, True), (0.0, False)])
def test_a_cell_at_its_end_is_no_servo_at_its_limit(noise: float, told: bool) -> None:
    """A servo that may pull no more was taken for a cell's end in logs without noise."""
    scatter = noise * np.random.default_rng(0).standard_normal(ROWS)
    force = np.minimum(4.0 + 3.0 * np.sin(2.0 * TIME) + scatter, 5.5)[:, None]
    found = [one.evidence for one in lint_recording(log(force=force))]
    assert [" % in " not in text and "is 5.5 in " in text for text in found] == [True] * told


def test_rows_at_a_known_limit_are_counted() -> None:
    """Only a limit that is known can be reached."""
    force = (20.5 + np.sin(3.0 * TIME))[:, None]
    assert lint_recording(log(force=force)) == ()
    finding = only(lint_recording(log(force=force), {"force": 21.0}))
    assert finding.evidence.startswith("279 of 800 rows (35 %, t = 0.175-0.8625, ")
    assert finding.evidence.endswith("s and more) are at the limit of 21")


def test_a_shaft_that_rests_under_a_moving_goal_is_noted() -> None:
    """Sticking is no defect, but a reader must know that these rows say little."""
    goal = np.sin(TIME)
    theta = play(goal, 0.4)[:, None]
    found = lint_recording(
        log(
            command=goal[:, None],
            motor_position=theta,
            motor_velocity=np.gradient(theta, TIME, axis=0),
        )
    )
    (finding,) = (f for f in found if f.channel == "theta")
    assert finding.severity == "note"
    assert "from t = 7.85 s" in finding.evidence  # where the sine turns


def test_a_shaft_that_hears_late_does_not_rest_under_a_moving_goal() -> None:
    """A second at rest, a step, and 40 ms until the shaft moves: the delay held it, no friction."""
    goal, theta = (0.5 * np.heaviside(TIME - begin, 1.0)[:, None] for begin in (1.0, 1.04))
    swing = np.where(TIME < 2.0, 0.0, np.sin(3.0 * (TIME - 2.0)))[:, None]
    found = lint_recording(
        log(command=goal + swing, motor_position=theta + swing, motor_velocity=swing)
    )
    assert not [finding for finding in found if finding.channel == "theta"]


def test_temperature_that_goes_with_a_setting_is_found() -> None:
    """Two gains at two temperatures cannot be told apart; the same temperature can."""

    def at(gain: float, temperature: float) -> Recording:
        return log(
            actuator_overrides={"gain": gain},
            temperature=np.full(ROWS, temperature),
            motor_position=gain * np.sin(3.0 * TIME)[:, None],
        )

    finding = only(lint_dataset([at(1.0, 29.0), at(2.0, 37.0)], []))
    assert finding.evidence == "goes with gain: 29.0 degC at 1, 37.0 degC at 2"
    assert lint_dataset([at(1.0, 29.0), at(2.0, 29.5)], []) == ()


def test_a_test_recording_that_was_trained_on_is_found() -> None:
    """Equal rows in both splits are no held-out data."""
    finding = only(lint_dataset([log(name="seen.csv")], [log(name="held.csv")]))
    assert (finding.recording, finding.severity) == ("held.csv", "defect")


def test_equal_findings_are_written_once_with_their_recordings() -> None:
    """The report groups by what follows, the worst first."""
    found = [
        Examined("a", "t").note("ea", "c"),
        Examined("b", "t").defect("eb", "c"),
        Examined("c", "t").note("ec", "c"),
    ]
    assert findings_text(found) == [
        "",
        "defect, t: c",
        "  b  eb",
        "",
        "note, t: c",
        "  a  ea",
        "  c  ec",
    ]


@pytest.mark.slow
def test_no_reference_recording_has_a_defect(shared: Path) -> None:
    """Data of planted mechanisms are sound data: no check may call physics a defect."""
    for path in sorted((shared / "challenges").glob("*/dataset.toml")):
        loaded = load_dataset(path.parent)
        for recording in (*loaded.train, *loaded.test):
            assert [f for f in lint_recording(recording) if f.severity == "defect"] == []


def test_a_slow_motion_in_coarse_counts_is_told() -> None:
    """It stays or goes one count a row; a steady motion of one step a row has no such rest."""
    theta = np.round(0.3 * TIME / 0.02)[:, None] * 0.02
    speed = np.full((ROWS, 1), 0.3)
    found = lint_recording(log(motor_position=theta, motor_velocity=speed))
    assert any("changes in steps of 20 mrad" in f.evidence for f in found)
