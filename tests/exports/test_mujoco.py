"""An identified model in plain MuJoCo: what it does there, and what it says of itself."""

# The stubs of mujoco leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import warp as wp

from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports import EXPORTS
from tendon_newton.exports.departure import departure, replayed
from tendon_newton.exports.model_numbers import FURTHER_SENSORS
from tendon_newton.exports.mujoco.mujoco_program import program_text, servo_numbers
from tendon_newton.exports.mujoco.mujoco_target import (
    IN_THE_FILE,
    MODEL_FILE,
    PROGRAM_FILE,
    write_model_file,
    write_mujoco_target,
)
from tendon_newton.mechanisms.authoring.mujoco_file import named_apart
from tendon_newton.simulation.hosts.replay import bench_of, replay
from tests.exports.models import ANGLE, FORCE, TYPICAL, model_of, strays, strays_of
from tests.interpreters import python
from tests.made import stated_model
from tests.physics.runs import held_run, ideal_model, run_of
from tests.test_imports import top_level_imports

ALONE = f"{MODEL_FILE} alone"
ACTUATOR_SIDE = (
    "command_delay", "actuator_lag", "viscous_friction", "stribeck_friction",
    "load_dependent_friction", "routing_friction", "viscoelastic_spring", "inertia_error",
    "gravity_misalignment", "load_cell_delay", "load_cell_lag",
)  # fmt: skip
ROTOR_SIDE = ("tendon_slack", "coulomb_friction", "tendon_compliance", "torque_fade", "speed_limit")


@pytest.mark.parametrize(
    ("bench", "actuator", "effects"),
    [
        ("finger", "ideal", ACTUATOR_SIDE),
        ("finger", "pwm_servo", ROTOR_SIDE),
        # a jump back lets the string go, and the rotor is caught again where ours is
        ("spring_weak", "pwm_servo", ()),
    ],
)
def test_many_effects_at_once_run_in_mujoco(bench, actuator, effects, tmp_path) -> None:
    """The program beside the file strays by less than an encoder count and 0.05 N."""
    found = strays(tmp_path, "mujoco", PROGRAM_FILE, bench, actuator, *effects)
    assert found.angle < ANGLE
    assert found.force < FORCE


def test_a_duty_that_is_always_added_is_carried(tmp_path: Path) -> None:
    """The program strays as little as without; the file's actuator gives u_0 V k_t / R at rest."""
    plain = model_of("spring_weak", "pwm_servo")
    values = {**plain.actuator.values, "duty_offset": 0.2}
    model = replace(plain, actuator=NamedValues(name="pwm_servo", values=values))
    found = strays_of(tmp_path, "mujoco", PROGRAM_FILE, "spring_weak", model)
    assert found.angle < ANGLE
    assert found.force < FORCE
    file = mujoco.MjModel.from_xml_path(str(tmp_path / MODEL_FILE))
    supply, constant, resistance = (
        float(values[key]) for key in ("supply_voltage", "torque_constant", "resistance")
    )
    expected = 0.2 * supply * constant / resistance
    assert file.actuator_biasprm[0, 0] == pytest.approx(expected, rel=1e-6)


def test_a_start_at_a_measured_angle_stretches_the_string_there_too(tmp_path: Path) -> None:
    """The string carries what its slider takes at the first row, as in our own simulation."""
    model, bench = model_of("spring_weak", "pwm_servo", "tendon_compliance"), "spring_weak"
    run = run_of(np.full(8, 1.5), bench=bench, start="first_row", angle=1.5)
    mechanism, target = bench_of(bench, model), EXPORTS["mujoco"]
    exported = target.write(tmp_path, mechanism, model)
    (theirs,) = replayed(target, exported, PROGRAM_FILE, model, [run])
    (ours,) = replay([run], model)
    assert ours.force[0, 0] > 3.0
    assert theirs.force[0, 0] == pytest.approx(ours.force[0, 0], rel=1e-3)
    found = departure(mechanism, [theirs], [ours])
    assert found.angle < ANGLE
    assert found.force < FORCE


@pytest.mark.parametrize(("friction", "travel"), [(0.3, 0.0), (0.0, 0.0), (0.3, 2e-4)])
def test_a_program_starts_where_friction_holds_its_servo_too(friction, travel, tmp_path) -> None:
    """A log begins 19 mrad short of equilibrium; a program without friction starts in that.

    Where bristles bend they are bent by what holds the servo.
    """
    bench, target = "spring_weak", EXPORTS["mujoco"]
    model = ideal_model(coulomb_friction={"force": friction}, presliding={"travel": travel})
    run = held_run(ideal_model(coulomb_friction={"force": 0.3}), bench)
    mechanism = bench_of(bench, model)
    exported = target.write(tmp_path, mechanism, model)
    (theirs,) = replayed(target, exported, PROGRAM_FILE, model, [run])
    (ours,) = replay([run], model)
    assert departure(mechanism, [theirs], [ours]).angle < ANGLE


def test_a_guide_holds_between_two_parts_of_a_string_in_the_program_too(tmp_path) -> None:
    """A guide at the mechanism in its place would be 0.09 N off."""
    values = {"exponent": 0.17, "behind": 0.5}
    model = model_of("spring_weak", "pwm_servo", "tendon_compliance")
    guide = NamedValues(name="routing_friction", values=values)
    model = replace(model, effects=(*model.effects, guide))
    found = strays_of(tmp_path, "mujoco", PROGRAM_FILE, "spring_weak", model)
    assert found.angle < ANGLE
    assert found.force < FORCE


@pytest.mark.parametrize("actuator", ["ideal", "pwm_servo"])
def test_bristles_of_gear_and_guides_bend_in_the_program_too(actuator, tmp_path) -> None:
    """Without them the force would be 0.5 N off."""
    effects = ("coulomb_friction", "presliding", "routing_friction")
    found = strays(tmp_path, "mujoco", PROGRAM_FILE, "spring_weak", actuator, *effects)
    assert found.angle < ANGLE
    assert found.force < FORCE


@pytest.mark.parametrize("friction", ["gear_load_friction", "routing_friction"])
def test_a_jump_is_read_on_the_side_on_which_the_tendon_then_slides(friction, tmp_path) -> None:
    """A rotor feels as heavy as that side makes it, and the slowest motion is no rest."""
    found = strays(tmp_path, "mujoco", PROGRAM_FILE, "finger", "pwm_servo", friction)
    assert found.force < FORCE


@pytest.mark.parametrize(
    ("bench", "effects"),
    [
        ("finger", ()),
        ("finger", ("coulomb_friction",)),
        ("finger", ("tendon_slack",)),
        ("spring_weak", ()),
    ],
)
def test_a_rotor_in_the_file_alone_turns_as_ours(bench, effects, tmp_path) -> None:
    """A DC motor gives force both ways, so that it pays its string out as fast as ours."""
    found = strays(tmp_path, "mujoco", ALONE, bench, "pwm_servo", *effects)
    assert found.angle < ANGLE
    assert found.force < FORCE


def test_an_ideal_servo_in_the_file_alone_pushes_no_more_than_its_friction_takes(tmp_path) -> None:
    """Its string never pushes; without any push the friction would hold the finger closed."""
    model = model_of("finger", "ideal", "coulomb_friction")
    write_model_file(tmp_path / MODEL_FILE, bench_of("finger", model), model)
    file = mujoco.MjModel.from_xml_path(str(tmp_path / MODEL_FILE))
    friction = TYPICAL["coulomb_friction"]["force"]
    least, most = file.actuator_forcerange[0] * file.actuator_gear[0, 0]
    assert least == pytest.approx(-friction)
    assert most == pytest.approx(21.0)
    file.opt.gravity[:] = 0.0
    opened = []
    for floor in (file.actuator_forcerange[0, 0], 0.0):
        file.actuator_forcerange[0, 0] = floor
        data = mujoco.MjData(file)
        data.qpos[:] = 0.05  # the springs alone cannot overcome the friction there
        data.ctrl[0] = -1.0
        mujoco.mj_step(file, data, nstep=round(1.0 / file.opt.timestep))
        opened.append(float(np.abs(data.qpos).max()))
    assert opened[0] < 0.01
    assert opened[1] > 0.03


def test_the_file_alone_says_what_it_leaves_out(tmp_path: Path) -> None:
    """What MJCF has no words for stands in the list; of the program, what it has nearly."""
    model = model_of("finger", "ideal", "gain_error", "backlash", "load_cell_bias")
    exported = write_mujoco_target(tmp_path, bench_of("finger", model), model)
    assert exported.left_out == {ALONE: ("backlash", "load_cell_bias"), PROGRAM_FILE: ("backlash",)}


@pytest.fixture(scope="module")
def finger_file(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list, list]:
    """The finger in MJCF, with the signs and offsets of its tendons."""
    path = tmp_path_factory.mktemp("finger") / MODEL_FILE
    model = model_of("finger", "pwm_servo")
    return (path, *write_model_file(path, bench_of("finger", model), model))


@pytest.mark.parametrize("actuator", ["ideal", "pwm_servo"])
@pytest.mark.parametrize("effect", EFFECTS)
def test_the_program_of_every_effect_is_whole(effect, actuator, finger_file) -> None:
    """It compiles, needs nothing but MuJoCo and numpy, and takes a step."""
    text, hook = program_of(model_of("finger", actuator, effect), finger_file)
    assert top_level_imports(text) <= {*sys.stdlib_module_names, "mujoco", "numpy", "onnxruntime"}
    hook.reset([0.3])
    hook.command[:] = 0.6
    hook.step()
    reading = hook.read()
    assert reading.angle[0] == pytest.approx(0.3, abs=0.3)  # at rest below its command
    carried = any(line.startswith("def ") and effect in line for line in text.splitlines())
    numbers = ("inertia_error", "gravity_misalignment", "sample_period_error")
    assert carried or effect in (*numbers, *FURTHER_SENSORS)


def program_of(model: Model, file: tuple[Path, list, list], **options: float) -> tuple[str, Any]:
    """Return the program of a finger's model, and its hook; options are MuJoCo's."""
    path, signs, offsets = file
    mechanism = bench_of("finger", model)
    servos = servo_numbers(mechanism, model, signs, offsets)
    text = program_text(mechanism, model, servos, title="A finger.", span=(0.0, 1.0))
    scope: dict = {"__name__": "tendon_step", "__file__": str(path.parent / PROGRAM_FILE)}
    exec(compile(text, PROGRAM_FILE, "exec"), scope)
    mj_model = mujoco.MjModel.from_xml_path(str(path))
    for name, value in options.items():
        setattr(mj_model.opt, name, value)
    return text, scope["make_hook"](mj_model, mujoco.MjData(mj_model))


@pytest.mark.slow
def test_two_commands_lead_from_a_model_to_a_running_simulation(tmp_path: Path) -> None:
    """The second is plain Python, isolated from this package."""
    model = tmp_path / "model.toml"
    write_model(model, model_of("finger", "ideal", "command_delay"))
    words = ["export", model, "--to", "mujoco", "--out", tmp_path / "out"]
    said = python("-m", "tendon_newton", *words)
    assert PROGRAM_FILE in said.stdout
    page = (tmp_path / "out" / "README.md").read_text(encoding="utf-8")
    assert "| tendon_step.py |" in page
    assert "| model.xml alone | command_delay |" in page
    commands = tmp_path / "commands.csv"
    commands.write_text("t,theta_d\n" + "".join(f"{k / 80},{0.5}\n" for k in range(8)))
    run = [sys.executable, "-I", PROGRAM_FILE, str(commands), "--out", "replay.csv"]
    said = subprocess.run(run, capture_output=True, text=True, check=True, cwd=tmp_path / "out")
    assert "8 rows" in said.stdout
    rows = (tmp_path / "out" / "replay.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "t,theta,theta_dot,force"
    assert len(rows) == 9


@pytest.mark.parametrize(
    ("bench", "actuator", "effects"),
    [
        ("finger", "ideal", ("command_delay", "coulomb_friction")),
        ("finger", "pwm_servo", ()),
        ("thumb", "ideal", ()),
    ],
)
def test_the_file_runs_in_mujoco_warp_as_in_mujoco(bench, actuator, effects, tmp_path) -> None:
    """Two worlds come to where plain MuJoCo comes within 0.1 s: motor, delay, friction, tendon."""
    import mujoco_warp

    model = model_of(bench, actuator, *effects)
    path = tmp_path / MODEL_FILE
    write_model_file(path, bench_of(bench, model), model)
    plain = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(plain)
    worlds = mujoco_warp.put_data(plain, data, nworld=2)
    batch = mujoco_warp.put_model(plain)
    data.ctrl[:] = 0.8
    worlds.ctrl.fill_(0.8)
    mujoco_warp.step(batch, worlds)  # compiles before the capture
    with wp.ScopedCapture(device="cpu") as capture:
        mujoco_warp.step(batch, worlds)
    for _ in range(199):
        wp.capture_launch(capture.graph)
    for _ in range(200):
        mujoco.mj_step(plain, data)
    assert np.abs(data.qpos).max() > 0.05
    for world in worlds.qpos.numpy():
        assert world == pytest.approx(data.qpos, abs=1e-5)  # float32


def test_a_hand_has_a_servo_for_each_of_its_fingers(tmp_path: Path) -> None:
    """MJCF has no paths: each name begins with its finger's."""
    model = model_of("hand", "pwm_servo")
    write_model_file(tmp_path / MODEL_FILE, named_apart(bench_of("hand", model)), model)
    file = mujoco.MjModel.from_xml_path(str(tmp_path / MODEL_FILE))
    motors = [file.actuator(k).name for k in range(file.nu)]
    assert motors == ["index_flexor", "little_flexor", "middle_flexor", "ring_flexor"]


def test_a_servo_without_force_is_refused(tmp_path: Path) -> None:
    """MuJoCo could not apply it."""
    model = stated_model("ideal_position")
    with pytest.raises(InvalidModelFile, match="gives a force"):
        write_mujoco_target(tmp_path, bench_of("servo", model), model)
    assert not list(tmp_path.iterdir())


def test_a_tendon_that_sticks_does_not_creep(finger_file: tuple[Path, list, list]) -> None:
    """Two seconds of a held force move it by less than a micrometre."""
    model = model_of("finger", "ideal", "coulomb_friction")
    _, hook = program_of(model, finger_file, timestep=5.0e-4)
    hook.reset([0.5])
    before = hook.read().angle[0]
    hook.command[:] = 0.6  # 0.42 N more, of 0.6 N that stick
    for _ in range(4000):
        hook.step()
    assert abs(hook.read().angle[0] - before) * 0.0125 < 1.0e-6


def test_the_typical_numbers_are_those_of_every_effect() -> None:
    """The study leaves none out, and the file's own list neither."""
    assert set(TYPICAL) == set(EFFECTS) == set(IN_THE_FILE)
