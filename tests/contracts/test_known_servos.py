"""A servo that ships is named like a file, and is the same servo on any spool."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnosed_bench import open_model
from tendon_newton.diagnosis.known_servos import known_servos, servo_alone
from tendon_newton.diagnosis.posterior import read_posterior
from tendon_newton.errors import InvalidModelFile, InvalidParameter, UnknownName
from tendon_newton.exports.source import read_source
from tendon_newton.identification.study import Study, replacements
from tendon_newton.mechanisms.asset_library import FOLDERS_VARIABLE
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.worlds.force_model import open_force_model, trust_force
from tests.made import stated_model

SERVOS = sorted(known_servos())
ON_A_STAND = stated_model(
    "pwm_servo",
    {
        "duty_per_rad": 1.15,
        "max_duty": 1.0,
        "supply_voltage": 7.4,
        "torque_constant": 0.4,
        "resistance": 3.5,
        "armature": 0.0015,
        "spool_radius": 1.0,
        "force_limit": 0.6,
    },
    {
        "command_delay": {"delay": 0.012},
        "viscous_friction": {"coefficient": 0.006},
        "hysteresis": {"force": 0.01, "travel": 0.05, "exponent": 1.0},
        "gear_load_friction": {"coefficient": 0.1},
        "voltage_sag": {"sag": 0.3},
        "torque_fade": {"fade": 3.0, "time_constant": 0.7},
        "backlash": {"width": 0.02},
        "position_offset": {"angle": 0.03},
    },
    bench_overrides={"pendulum": BenchOverrides(arm_mass=(0.02,))},
    fit=("torque_constant", "arm_mass"),
)
"""A servo as a stand with a shaft had it, with numbers of every unit, and the stand's own."""


def test_a_servo_turns_alike_on_any_spool() -> None:
    """Twice the radius, and a quarter of mass, spring and damping: the same motion of the shaft.

    The law r theta = l gives the shaft an inertia M r^2, a spring k r^2 and a damping d r^2. The
    two differ by single precision and by where steps end, 1e-4 of 2 rad.
    """
    small, large = (turned(radius, mass) for radius, mass in ((0.0125, 0.8), (0.025, 0.2)))
    assert np.ptp(small) > 1.0
    np.testing.assert_allclose(large, small, atol=2e-4)


def turned(radius: float, mass: float) -> np.ndarray:
    """Return what a servo on some spool turns when it pulls a cart of some mass [kg]."""
    share = mass / 0.8
    cart = BenchOverrides(
        mass=(mass,), stiffness=(1500.0 * share,), damping=(20.0 * share,),
        range=(0.0375 * (radius / 0.0125),),
    )  # fmt: skip
    time = np.arange(160) / 80.0
    goal = np.where(time < 1.0, 2.0, 0.4)[:, None]
    return -left(servo_alone(ON_A_STAND, radius), "spring_weak", cart, time, goal, 0.0 * goal)


def left(model, bench, stand, time, goal, angle) -> np.ndarray:
    """Return measured angles less simulated ones, by a kernel that holds the model alone."""
    run = Recording(
        name="run.csv", bench=bench, time=time, command=goal, motor_position=angle,
        motor_velocity=0.0 * angle, bench_overrides=stand, start="first_row",
    )  # fmt: skip
    own = tuple(effect.name for effect in model.effects)
    (found,) = Study([run], model, own).residuals(*replacements([{}]))
    return found.theta[0]


def test_the_stand_stays_behind() -> None:
    """Its arm and the zero of its encoder are none of the servo's; play is, on another shaft."""
    alone, turned = (servo_alone(ON_A_STAND, radius) for radius in (0.0125, 1.0))
    for model, kept in ((alone, set()), (turned, {"backlash"})):
        stand = {"position_offset", "backlash"}
        assert stand & {effect.name for effect in model.effects} == kept
    assert alone.bench_overrides == {}
    assert alone.fit == ("torque_constant",)
    assert alone.actuator.values["force_limit"] == pytest.approx(0.6 / 0.0125)


@pytest.mark.parametrize("name", SERVOS)
def test_a_name_stands_wherever_a_model_does(name: str) -> None:
    """Trainings, worlds and exports have one servo; on a finger its torque pulls at the spool."""
    finger = load_mechanism("finger")
    radius = finger.tendons[0].spool_radius
    model = open_model(Path(name), [finger])
    assert model.actuator.values["spool_radius"] == radius
    assert open_force_model(name, finger).model.effects == model.effects
    assert read_source(Path(name), "finger", None).model.actuator == model.actuator
    assert read_source(Path(name), None, None).mechanism.name == "finger"  # no stand
    trust_force(name)  # nothing of it is a program


@pytest.mark.parametrize("name", SERVOS)
def test_a_packaged_servo_moves_as_it_did_when_its_error_was_measured(name: str) -> None:
    """Steps of its stand, to 1 mrad: a twentieth of what it leaves of logs that it has not seen."""
    home = known_servos()[name]
    steps = json.loads((home / "evidence.json").read_text())["steps"]
    model = load_model(home / "model.toml")
    angle = np.array(steps["angle_rad"])[:, None]
    time = np.arange(angle.size) / steps["rate_hz"]
    goal = np.repeat(steps["goal_rad"], time.size // len(steps["goal_rad"]))[:, None]
    stand = BenchOverrides(mass=(steps["mass_kg"],), length=(steps["length_m"],))
    assert np.abs(left(model, "pendulum", stand, time, goal, angle)).max() < 1e-3


def test_a_users_own_servo_is_known_by_its_folder(tmp_path: Path, monkeypatch) -> None:
    """One folder beside the user's assets; one of our name stands for ours."""
    for name in ("mine", SERVOS[0]):
        shutil.copytree(known_servos()[SERVOS[0]], tmp_path / "servos" / name)
    monkeypatch.setenv(FOLDERS_VARIABLE, str(tmp_path))
    assert open_model(Path("mine"), [load_mechanism("pendulum")]).actuator.name == "pwm_servo"
    assert known_servos()[SERVOS[0]] == tmp_path / "servos" / SERVOS[0]


def test_a_file_of_a_known_servo_is_that_servo() -> None:
    """Its model alone is a servo on a stand's shaft of 1 m: on a finger it must be carried over."""
    finger, home = load_mechanism("finger"), known_servos()[SERVOS[0]]
    by_name = open_model(Path(SERVOS[0]), [finger])
    assert open_model(home / "model.toml", [finger]) == by_name
    assert open_model(home / "diagnosis.json", [finger]) == by_name


def test_what_a_model_says_exactly_goes_along() -> None:
    """A limit that a register holds is no cause on another bench either."""
    stated = {"command_rate_limit": 0.0, "torque_constant": 0.05, "joint_stiffness_error": 0.1}
    alone = servo_alone(replace(ON_A_STAND, tolerances=stated), 0.0125)
    assert alone.tolerances == {"command_rate_limit": 0.0, "torque_constant": 0.05}


def test_a_servo_is_written_with_a_users_gain_and_supply(tmp_path: Path) -> None:
    """Half the gain in the register is half the duty per radian; the worlds come along."""
    name, finger = SERVOS[0], load_mechanism("finger")
    gain = json.loads((known_servos()[name] / "evidence.json").read_text())["gains"][0]
    for share in (1.0, 0.5):
        words = ["servo", name, "--gain", str(share * gain), "--supply", "5"]
        assert main([*words, "--out", str(tmp_path / f"{share}")]) == 0
    full, half = (open_model(tmp_path / share, [finger]) for share in ("1.0", "0.5"))
    duties = [model.actuator.values["duty_per_rad"] for model in (full, half)]
    assert duties[1] == pytest.approx(0.5 * duties[0])
    assert half.actuator.values["supply_voltage"] == 5.0
    assert half.effects == open_model(Path(name), [finger]).effects
    assert read_posterior(tmp_path / "0.5" / "diagnosis.json").sets
    for wrong in (("--gain", "0"), ("--supply", "300")):
        assert main(["servo", name, *wrong, "--out", str(tmp_path / "none")]) == 2


def test_other_words_and_benches_of_several_spools_are_refused() -> None:
    """A slip of the pen is told with the names that there are."""
    finger = load_mechanism("finger")
    with pytest.raises(UnknownName, match=f"named '{SERVOS[0]}0'; did you mean '{SERVOS[0]}'"):
        open_model(Path(SERVOS[0] + "0"), [finger])
    with pytest.raises(InvalidModelFile, match="must state the spool_radius"):
        servo_alone(stated_model("ideal", {"gain": 4.2}), 0.0125)
    with pytest.raises(InvalidParameter, match="one at a time"):
        open_model(Path(SERVOS[0]), [finger, load_mechanism("pendulum")])


def test_a_file_of_the_same_name_counts_more(tmp_path: Path, monkeypatch) -> None:
    """What a user has in the folder is meant."""
    monkeypatch.chdir(tmp_path)
    own = replace(ON_A_STAND, bench_overrides={}, fit=())
    write_model(Path(SERVOS[0]), own)
    assert open_model(Path(SERVOS[0]), [load_mechanism("pendulum")]).effects == own.effects
