"""The table of signals: what is compared, with its own zero and scale, and how a row is added."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.checks.measures import difference_noise
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.effects.joint_encoder_delay import JointEncoderDelay
from tendon_newton.effects.tip_sensor_delay import TipSensorDelay
from tendon_newton.identification import testable
from tendon_newton.identification.objective import layout, stack
from tendon_newton.identification.signals import SIGNALS, Scales, Signal, of_servo
from tendon_newton.identification.study import Study, replacements
from tendon_newton.mechanisms.geometry.kinematics import tip_position
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tests.made import recorded, stated_model

FURTHER = [name for name, effect in EFFECTS.items() if effect.further_signals()]
SERVO = stated_model("ideal", {"gain": 4.2})

K_T = 0.9  # [N m/A, V s/rad]
MOTOR = stated_model("pwm_servo", {
            "duty_per_rad": 0.1, "max_duty": 1.0, "supply_voltage": 9.0, "torque_constant": K_T,
            "resistance": 15.0, "armature": 2.5e-3, "spool_radius": 0.0125,
        })  # fmt: skip


def measured(bench: str = "finger", **signals: np.ndarray) -> Recording:
    """A recording that the model explains exactly, with the tip of a finger and its joints."""
    time = np.arange(0.0, 1.5, 0.0125)
    wave = (1.5 - np.cos(4.0 * time))[:, None]
    blank = recorded(time, 0.0 * wave, bench=bench, command=wave)
    (run,) = replay([blank], SERVO, time_step=1e-3)
    mechanism = load_mechanism(bench)
    tip = tip_position(mechanism, run.joint_position)
    own = {"joint_position": run.joint_position, "tip": None if tip is None else tip[:, [0, 2]]}
    return replace(
        blank, motor_position=run.motor_position, motor_velocity=run.motor_velocity,
        force=run.force, **{**own, **signals},
    )  # fmt: skip


def study_of(*recordings: Recording, tolerant: bool = False) -> Study:
    """Compare recordings with the model."""
    effects = ("gain_error", *FURTHER)
    return Study(recordings, SERVO, effects, time_step=1e-3, tolerant=tolerant)


def test_zeros_of_encoders_are_no_error() -> None:
    """Joints count from where they were switched on."""
    run = measured()
    assert run.joint_position is not None
    off = replace(run, joint_position=run.joint_position + np.array([0.7, -0.2]))
    (left,) = study_of(off).residuals(*replacements([{}]))
    assert list(left.signals) == ["theta", "force", "joint", "tip"]
    assert np.abs(left.signals["joint"]).max() < 1e-9


def test_a_camera_may_stand_anywhere() -> None:
    """Where its zero is says nothing; what is left is the rounding of a float32 asset."""
    run = measured(joint_position=None)
    assert run.tip is not None
    (left,) = study_of(replace(run, tip=run.tip + np.array([0.3, -0.1]))).residuals(
        *replacements([{}])
    )
    assert list(left.signals) == ["theta", "force", "tip"]
    assert np.abs(left.signals["tip"]).max() < 1e-9


@pytest.mark.parametrize(
    ("sensor", "signal", "read", "field", "most", "least"),
    [
        ("tip_sensor", "tip", TipSensorDelay.tip_reading, "tip", 5e-5, 1e-3),
        # a cubic spline through rows of 80 Hz misses what lies between by a thousandth of a radian
        ("joint_encoder", "joint", JointEncoderDelay.joint_reading, "joint_position", 1e-3, 20e-3),
    ],
)
def test_a_sensor_that_is_off_is_a_cause(sensor, signal, read, field, most, least) -> None:
    """With the factor and the delay by which it is off nothing is left, and else much."""
    run = measured(joint_position=None) if signal == "tip" else measured()
    late = read(getattr(run, field), run.time, np.array([0.031]))
    study = study_of(replace(run, **{field: 1.07 * late}))
    columns = [study.table.columns(f"{sensor}_{name}")[0] for name in ("gain", "delay")]
    off = dict(zip(columns, (1.07, 0.031), strict=True))
    right, bare = study.residuals(*replacements([off, {}]))[0].signals[signal]
    assert np.abs(bare).max() > least
    assert np.abs(right).max() < most


def test_a_tip_follows_the_lengths_of_its_links() -> None:
    """Where links may be as built, a longer one moves the tip as a longer finger's."""
    lengths = (0.0305, 0.0255)
    run = measured(joint_position=None)
    study = study_of(run, tolerant=True)
    names = [study.table.owners[c][1].name for c in study.tolerated_columns]
    columns = [c for c, n in zip(study.tolerated_columns, names, strict=True) if "length" in n]
    built = override_mechanism(load_mechanism("finger"), BenchOverrides(length=lengths))
    (moved,) = study.residuals(*replacements([dict(zip(columns, lengths, strict=True))]))
    stated = replace(SERVO, bench_overrides={"finger": BenchOverrides(length=lengths)})
    (other,) = replay([replace(run, tip=None)], stated, time_step=1e-3)
    tip = tip_position(built, other.joint_position)
    assert tip is not None
    assert run.tip is not None
    expected = run.tip - tip[:, [0, 2]]
    expected -= expected.mean(axis=0)
    assert pytest.approx(expected, abs=1e-7) == moved.signals["tip"][0].T
    assert np.abs(expected).max() > 4e-4


def with_current(**stated: str) -> Recording:
    """A slider behind a motor, with the current that V, R and the voltage of its rotor give."""
    time = np.arange(0.0, 1.5, 0.0125)
    wave = (1.5 - np.cos(4.0 * time))[:, None]
    blank = Recording(name="run.csv", bench="spring_weak", time=time, command=wave,
                      motor_position=0.0 * wave, motor_velocity=0.0 * wave)  # fmt: skip
    (run,) = replay([blank], MOTOR, time_step=1e-3)
    known = MOTOR.actuator.values
    duty = float(known["duty_per_rad"]) * (wave - run.motor_position)
    free = duty * float(known["supply_voltage"]) - K_T * run.motor_velocity
    return replace(
        blank, motor_position=run.motor_position, motor_velocity=run.motor_velocity,
        force=run.force, current=free[:, 0] / float(known["resistance"]), **stated,
    )  # fmt: skip


def test_the_current_of_a_winding_is_compared() -> None:
    """I = (u V - k_t theta_dot) / R explains it, whatever is read at rest; a supply's is not."""
    run = with_current(current_in="winding")
    assert run.current is not None
    study = Study([replace(run, current=1.2 * run.current + 0.05)], MOTOR, FURTHER, time_step=1e-3)
    assert {"current_sensor_gain", "current_sensor_delay"} <= {*testable.testable_effects(study)}
    (column,) = study.table.columns("current_sensor_gain")
    right, bare = study.residuals(*replacements([{column: 1.2}, {}]))[0].signals["current"]
    assert np.abs(right).max() < 1e-9
    assert np.abs(bare).max() > 2e-3
    assert "current" not in Study([with_current()], MOTOR, (), time_step=1e-3).compared[0]


def test_a_supply_falls_with_the_force_that_it_costs() -> None:
    """V = V0 / (1 + sag P |theta_d - theta|), whatever V0; what is read besides is a sensor's."""
    sag, more = 0.04, 0.01
    run = measured(joint_position=None, tip=None)
    model = replace(SERVO, effects=(NamedValues(name="voltage_sag", values={"sag": sag}),))
    (weak,) = replay([run], model, time_step=1e-3)
    asked = 4.2 * np.abs(run.command - weak.motor_position)[:, 0]
    left = 1.0 / (1.0 + sag * asked)
    run = replace(run, motor_position=weak.motor_position, motor_velocity=weak.motor_velocity,
                  force=weak.force, voltage=7.1 * (left - more * asked * left))  # fmt: skip
    study = Study([run], SERVO, ("voltage_sag", *FURTHER), time_step=1e-3)
    assert "voltage_sensor_sag" in testable.testable_effects(study)
    causes = [study.table.columns(name)[0] for name in ("voltage_sag", "voltage_sensor_sag")]
    candidates = [dict(zip(causes, sizes, strict=True)) for sizes in ((sag, more), (sag, 0.0))]
    right, without = study.residuals(*replacements(candidates))[0].signals["voltage"]
    assert np.abs(right).max() < 1e-9
    assert np.abs(without).max() > 0.1


@pytest.mark.parametrize(("model", "volts"), [(SERVO, 0.0), (MOTOR, 0.3)])
def test_a_supply_that_is_given_is_not_compared(model: Model, volts: float) -> None:
    """One number in all rows may be stated, and a model with a motor takes it as it was read."""
    run = measured(joint_position=None, tip=None)
    run = replace(run, voltage=7.4 + volts * np.sin(run.time))
    study = Study([run], model, FURTHER, time_step=1e-3)
    assert list(study.compared[0]) == ["theta", "force"]
    assert "voltage_sensor_sag" not in testable.testable_effects(study)


def test_what_others_draw_from_a_supply_is_its_noise() -> None:
    """A motor beside this one takes half a volt six times a second: that is no gap of this one."""
    run = measured(joint_position=None, tip=None)
    others = 0.25 * np.sign(np.sin(12.0 * np.pi * run.time + 0.1))
    noise = study_of(replace(run, voltage=7.4 + others)).noise.of("voltage")
    assert noise == pytest.approx(0.25, rel=0.1)


def test_encoders_on_joints_are_no_cause_where_there_are_none() -> None:
    """A log of angle and force cannot tell what they read."""
    run = measured()
    seen = {name for name in FURTHER if not name.startswith(("current", "voltage"))}
    assert seen <= {*testable.testable_effects(study_of(run))}
    bare = testable.testable_effects(study_of(replace(run, joint_position=None, tip=None)))
    assert not any(EFFECTS[name].further_signals() for name in bare)


def test_every_joint_is_a_signal_of_its_own() -> None:
    """Two joints stand behind angle and force, in the blocks of their recording."""
    study = study_of(measured(tip=None))
    where = layout(study)
    assert [name for name, _ in where.signals] == ["theta", "force", "joint", "joint"]
    assert where.block_count == 2
    assert stack(study.residuals(*replacements([{}]))).shape == (1, 4 * 120)


def test_a_slider_has_its_own_unit() -> None:
    """An encoder on it tells metres; laws miss them by the tendon's part of the motor's turn."""
    study = study_of(measured("spring_weak"))
    assert list(study.compared[0]) == ["theta", "force", "slide"]
    form = study.form(Scales(theta=3e-3, force=0.1))
    assert form.of("slide") == pytest.approx(3e-3 * 0.0125, rel=1e-6)  # float32 of the asset


def test_recordings_without_further_signals_are_compared_as_ever() -> None:
    """Encoders and a camera beside them change no bit of what angle and force leave."""
    run = measured()
    bare = replace(run, joint_position=None, tip=None)
    column = study_of(bare).table.columns("gain_error")[0]
    (more,), (less,) = (study_of(r).residuals(*replacements([{column: 1.1}])) for r in (run, bare))
    assert list(less.signals) == ["theta", "force"]
    for name, values in less.signals.items():
        assert np.array_equal(values, more.signals[name])


def test_a_further_signal_is_one_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a row for the servo's speed it counts in a search, and held-out errors have it."""
    row = Signal(
        words="motor speed",
        unit="rad/s",
        shown=(1.0, "rad/s"),
        rollout=lambda _: "rate",
        measured=lambda view: view.recording.motor_velocity.T,
        simulated=of_servo("rate"),
        noise=lambda views: float(
            np.median([difference_noise(v.recording.motor_velocity[:, 0]) for v in views])
        ),
        form=lambda usual, _: 20.0 * usual.theta,
        by_servo=True,
    )
    monkeypatch.setitem(SIGNALS, "speed", row)
    run = measured(joint_position=None, tip=None)
    study = study_of(replace(run, motor_velocity=run.motor_velocity + 0.5))
    worlds = SearchWorlds(study)
    assert [name for name, _ in worlds.where.signals] == ["theta", "force", "speed"]
    (errors,) = evaluate_models(study, [{}])
    assert errors.pooled().others_rmse == {"speed": pytest.approx(0.5, abs=1e-9)}
