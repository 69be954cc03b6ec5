"""What is known of an arm before causes are looked for: how it stands, plain servos, its floor."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.actuators.ideal_position import IdealPosition
from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.arms.arm_simulation import SimulatedMotion, loaded, simulate_arm
from tendon_newton.arms.placement import Placement, find_placement
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.diagnose import extended_model
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.search.decide.plain_models import PLAIN_MODELS
from tendon_newton.diagnosis.search.fixed_set import fit_set_anew
from tendon_newton.diagnosis.search.refit import values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile, shown
from tendon_newton.identification.study import Study
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

PLAIN = PLAIN_MODELS["lag, delay, deadband and offset"]  # Effects of a plain servo
# Those that slow training motions hardly show, but all others need
TIMING = ("actuator_lag", "command_delay")


@dataclass(frozen=True, kw_only=True)
class KnownArm:
    """An arm, and a model of each of its servos."""

    placement: Placement
    arm: Arm  # As the placement has it, with its floor
    # From which the causes of each servo are looked for, J; with its lag and delay
    starts: tuple[Model, ...]
    plain: tuple[Model, ...]  # Plain models of the servos, fitted, J

    def with_loads(self, motions: Sequence[ArmMotion]) -> tuple[tuple[Recording, ...], ...]:
        """Return the recordings of each servo with the load on it, J of as many as motions.

        The weight is that of the measured posture. What the floor does is that of an arm of plain
        servos, which is told the commands alone.
        """
        states = simulate_arm(self.arm, dict(enumerate(self.plain)), motions)
        loads = [
            self.arm.weight(motion.angles) + state.loads - self.arm.weight(state.angles)
            for motion, state in zip(motions, states, strict=True)
        ]
        return each_servo(motions, loads)

    def servo(self, joint: int, found: Diagnosis) -> Model:
        """Return the model of a servo: its plain one where a diagnosis named nothing."""
        return found.model if found.effects else self.plain[joint]


def know_arm(
    mechanism: Mechanism, motions: Sequence[ArmMotion], starts: Sequence[Model]
) -> KnownArm:
    """Find how an arm stands and what its tip rests on.

    Joints are those of the training motions, in their order, and so are the starts, J models.

    Raises:
        InvalidRecording: The motions are not this arm's.
        InvalidModelFile: A servo is no ideal position servo, the only one that a load moves.
    """
    for joint, start in zip(mechanism.joint_names, starts, strict=False):
        if start.actuator.name != IdealPosition.name:
            raise InvalidModelFile(
                f"{joint}: servos of an arm start from actuator {IdealPosition.name!r}, which "
                f"gives way to its load; it is {shown(start.actuator.name)}: mend its model.toml, "
                "or leave the arm out"
            )
    placement = find_placement(mechanism, motions)
    arm = placement.arm
    told = [with_compliance(s, placement.compliance) if pulled else s
            for s, pulled in zip(starts, placement.loaded, strict=True)]  # fmt: skip
    recordings = each_servo(motions, [arm.weight(motion.angles) for motion in motions])
    plain = tuple(plain_servo(s, own) for s, own in zip(told, recordings, strict=True))
    arm = find_floor(arm, dict(enumerate(plain)), motions)
    known = KnownArm(placement=placement, arm=arm, starts=tuple(told), plain=plain)
    if arm.floor is not None:
        recordings = known.with_loads(motions)
        plain = tuple(plain_servo(s, own) for s, own in zip(told, recordings, strict=True))
    starts = tuple(timed(s, servo) for s, servo in zip(told, plain, strict=True))
    return replace(known, starts=starts, plain=plain)


def timed(start: Model, plain: Model) -> Model:
    """Return what is stated of a servo with the lag and delay of its plain model.

    What is stated of them stays.
    """
    stated = [effect.cause for effect in start.effects]
    timing = tuple(e for e in plain.effects if e.name in TIMING and e.cause not in stated)
    return replace(start, effects=(*start.effects, *timing))


def each_servo(
    motions: Sequence[ArmMotion], loads: Sequence[Array]
) -> tuple[tuple[Recording, ...], ...]:
    """Return the recordings of each servo with its loads [N m], of shapes (T, J) by motion."""
    pairs = list(zip(motions, loads, strict=True))
    servos = range(len(motions[0].recordings))
    return tuple(tuple(loaded(m.recordings[j], load[:, j]) for m, load in pairs) for j in servos)


def with_compliance(model: Model, compliance: float) -> Model:
    """Return a model whose servo gives way to its load, by about so much [rad/(N m)].

    What a model file states of its compliance stays.
    """
    if "compliance" in model.actuator.values:
        return model
    values = {**model.actuator.values, "compliance": compliance}
    fit = tuple(dict.fromkeys((*model.fit, "compliance")))
    return replace(model, actuator=replace(model.actuator, values=values), fit=fit)


def plain_servo(start: Model, recordings: Sequence[Recording]) -> Model:
    """Fit a plain model to a servo's recordings; one that gives way to its load has no offset.

    What is stated of a servo stays. One that is told nothing shows nothing: it stays as stated.
    """
    if all(np.ptp(r.command) == 0.0 for r in recordings if r.command is not None):
        return start
    study = Study(recordings, start, tuple(EFFECTS))
    known = (*study.known, *["position_offset"] * ("compliance" in start.fit))
    effects = [effect for effect in PLAIN if effect not in known]
    worlds = SearchWorlds(study)
    found = fit_set_anew(worlds, start, effects)
    return extended_model(study, start, values_of(worlds, found.columns, found.place), effects)


# Way [m] by which a free arm must go deeper than the measured one before a floor is looked for
DEEPER = 0.005
# Heights that are tried above the lowest place at which the tip was [m]: on one table an SO-101's
# lowest places are 10 mm apart (docs/lab/so101.md)
HEIGHTS = 0.004 * np.arange(4)
# Way of the tip by a servo [m/rad] from which on it can stop the servo short: a servo that is off
# by 0.1 rad moves it by 1 mm, a quarter of a step of the heights
LIFTS = 0.01
# Share of the squared error that a floor may leave of those motions, to be believed. Chosen: more
# than the one number of a floor takes away by chance, and less than a table does.
LESS = 0.9


def find_floor(arm: Arm, models: Mapping[int, Model], motions: Sequence[ArmMotion]) -> Arm:
    """Return an arm with the floor that its motions show, or as it is."""
    if arm.mechanism.tip is None:
        return arm
    heights, slopes = zip(*(arm.tip_height(motion.angles) for motion in motions), strict=True)
    lifts = np.abs(np.concatenate(slopes)).max(axis=0) > LIFTS
    models = {j: model for j, model in models.items() if lifts[j]}
    free = simulate_arm(arm, models, motions)
    low = min(float(height.min()) for height in heights)
    deep = [
        (motion, state)
        for motion, state in zip(motions, free, strict=True)
        if arm.tip_height(state.angles)[0].min() < low - DEEPER
    ]
    if not deep:
        return arm
    those = [motion for motion, _ in deep]
    arms = [replace(arm, floor=low + float(height)) for height in HEIGHTS]
    errors = [squared_error(those, simulate_arm(tried, models, those)) for tried in arms]
    best = int(np.argmin(errors))
    believed = errors[best] < LESS * squared_error(those, [state for _, state in deep])
    return arms[best] if believed else arm


def squared_error(motions: Sequence[ArmMotion], states: Sequence[SimulatedMotion]) -> float:
    """Return the sum of all servos' squared errors [rad2]."""
    pairs = zip(motions, states, strict=True)
    return sum(float(np.sum((state.angles - motion.angles) ** 2)) for motion, state in pairs)
