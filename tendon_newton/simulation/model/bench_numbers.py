"""Numbers of a bench that are unknown (a model's `fit`) or known to a few percent only.

They are columns of the parameter vector. They stand behind the effects, in the bench's own units.
Kernels do not read them there: a rollout writes them into the mechanism of each world.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.bench_overrides import BENCH_OVERRIDE_RANGES, OF_BENCH, BenchOverrides
from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import Parameter
from tendon_newton.data.recording import Array, Indices, Recording
from tendon_newton.errors import InvalidModelFile
from tendon_newton.mechanisms.geometry.arms import Body, with_arm, without_arm
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.overrides import override_mechanism, refusal_of

OWNER = "bench"  # Owner of these columns in a parameter table
# A number may turn out so many times as large, or as small, as where its search starts
REACH = 10.0
# Numbers of a bench that are as built and not as drawn, and two standard deviations of that: what
# kitchen scales and a ruler tell. Springs and dampers have effects of the catalogue.
TOLERATED, TOLERANCE = ("mass", "length", "moment_arm"), 0.05
# Times by which they differ at most: what is further off is another bench
ANOTHER = 1.25
# Times by which a line's numbers differ from bench to bench, at most
APART = 10.0
# The same by a standard deviation: lines are cut from one reel, and guided and tied by hand
USUALLY_APART = {
    "tendon_compliance": 1.3, "tendon_slack": 2.0, "routing_friction": 2.0,
    "joint_dry_friction": 2.0,
}  # fmt: skip
BY_DEFINITION = 1.0  # Moment arm of a slider and of a shaft: they have no other
# Arrays of a mechanism that these numbers change
WRITTEN = (
    "stiffness", "damping", "upper", "mass", "inertia", "centre", "offset", "arms", "spool_radius",
)  # fmt: skip
RADIUS = "spool_radius"  # The one number that a model states of its servo, and all benches have


@dataclass(frozen=True, kw_only=True)
class BenchNumber:
    """One unknown number of one bench, or of all of them."""

    bench: str  # Empty where it is of all benches
    key: str  # Key in ``bench_overrides``, or that of the spool's radius
    joint: int
    value: float  # Where its search starts [the key's unit]
    name: str  # The key, with bench and joint where there are several
    reach: float = REACH  # How many times as large, or as small, it may turn out
    tolerance: float = 0.0  # Share of it by which it usually differs [1]

    def is_of(self, bench: str) -> bool:
        """Tell whether a bench has this number."""
        return self.bench in ("", bench)

    @property
    def parameter(self) -> Parameter:
        """Return the number's column of a parameter table; a model file takes all of its range."""
        least, most, unit = BENCH_OVERRIDE_RANGES.get(self.key, (0.0, np.inf, "m"))
        low, high = sorted((self.value / self.reach, self.value * self.reach))
        low, high = max(low, least), min(high, most)
        return Parameter(
            self.name,
            unit,
            null=self.value,
            nominal=self.value,
            lower=low,
            upper=high,
            tolerance=self.tolerance,
        ).since(f"{self.reach:g} times either way")


def unknown_numbers(
    model: Model, benches: Mapping[str, Mechanism], recordings: Sequence[Recording]
) -> tuple[BenchNumber, ...]:
    """Return the numbers of benches that a model's ``fit`` names.

    The ``fit`` names numbers of the actuator too, which are left out. The benches have the model's
    own numbers, recordings may carry others.

    Raises:
        InvalidModelFile: A number is zero or missing on every bench, or recordings contradict.
    """
    actuator = {p.name for p in find_actuator(model.actuator.name).parameters}
    known = BENCH_OVERRIDE_RANGES.keys() - OF_BENCH.keys()
    keys = [key for key in model.fit if key in known and key not in actuator]
    refuse_mass_on_an_arm(keys, benches, recordings)
    out = [spool_number(model, benches)] if RADIUS in model.fit else []
    for key in keys:
        found = []
        for bench, mechanism in benches.items():
            values = start_values(key, bench, mechanism, recordings)
            found += numbers_of_joints(key, bench, benches, values)
        if not found:
            why = next((w for m in benches.values() if (w := refusal_of(m, key))), "")
            raise InvalidModelFile(
                f"fit names {key!r}, which no bench of the dataset has{why and ': '}{why}"
            )
        out += found
    return tuple(out)


def spool_number(model: Model, benches: Mapping[str, Mechanism]) -> BenchNumber:
    """Return the radius of the spool, which is that of one servo on all benches."""
    for bench, mechanism in benches.items():
        if any(tendon.direct for tendon in mechanism.tendons):
            raise InvalidModelFile(f"fit names {RADIUS!r}; bench {bench!r} has a shaft, no spool")
    first = next(iter(benches.values()))
    said = model.actuator.values.get(RADIUS)
    value = said if isinstance(said, float) else first.tendons[0].spool_radius
    return BenchNumber(bench="", key=RADIUS, joint=0, value=value, name=RADIUS)


def numbers_of_joints(
    key: str, bench: str, benches: Mapping[str, Mechanism], values: Sequence[float]
) -> list[BenchNumber]:
    """Return a number for each joint of a bench; names have bench and joint where several are.

    Joints of the same name, such as those of a hand's fingers, are counted from 0.
    """
    out, joints = [], benches[bench].joint_names
    for joint, value in enumerate(values):
        alike = [j for j, other in enumerate(joints) if other == joints[joint]]
        own = joints[joint] + f"_{alike.index(joint)}" * (len(alike) > 1)
        name = key if len(joints) == 1 else f"{key}_{own}"
        name = name if len(benches) == 1 else f"{bench}.{name}"
        out.append(BenchNumber(bench=bench, key=key, joint=joint, value=value, name=name))
    return out


def tolerated_numbers(
    model: Model, benches: Mapping[str, Mechanism], recordings: Sequence[Recording]
) -> tuple[BenchNumber, ...]:
    """Return the numbers of benches that may differ a little from what their assets state.

    Numbers that the model or a recording states stay as they are stated.
    """
    out = []
    for bench, mechanism in benches.items():
        stated = {key for r in recordings if r.bench == bench for key in r.bench_overrides.given}
        stated |= {*model.fit, *model.bench_overrides.get(bench, BenchOverrides()).given}
        if stated & {"arm_mass", "length"}:
            continue  # a link's mass, length and arm are one body
        for key in (key for key in TOLERATED if key not in stated):
            values = numbers_of(key, mechanism)
            if set(values) & {0.0, BY_DEFINITION}:
                continue
            out += [
                replace(number, reach=ANOTHER, tolerance=0.5 * TOLERANCE)
                for number in numbers_of_joints(key, bench, benches, values)
            ]
    return tuple(out)


def line_numbers(
    model: Model, benches: Mapping[str, Mechanism], recordings: Sequence[Recording]
) -> tuple[BenchNumber, ...]:
    """Return how many times as much of a line's effects each further bench has as the first.

    Numbers that the model or a recording states stay as they are stated.
    """
    out = []
    for bench in [*benches][1:]:
        stated = {key for r in recordings if r.bench == bench for key in r.bench_overrides.given}
        stated |= {*model.bench_overrides.get(bench, BenchOverrides()).given}
        out += [
            BenchNumber(
                bench=bench, key=key, joint=0, value=1.0, reach=APART,
                name=f"{bench}.{key}", tolerance=apart - 1.0,
            )
            for key, apart in USUALLY_APART.items() if key not in stated
        ]  # fmt: skip
    return tuple(out)


def refuse_mass_on_an_arm(
    keys: Sequence[str], benches: Mapping[str, Mechanism], recordings: Sequence[Recording]
) -> None:
    """Refuse to fit a link's mass or length beside an arm that is stated: one sum has two parts."""
    if "arm_mass" in keys or not {"mass", "length"} & set(keys):
        return
    if any(
        joint.arm_mass
        for r in recordings
        for joint in override_mechanism(benches[r.bench], r.bench_overrides).joints
    ):
        raise InvalidModelFile(
            "fit names mass or length of a bench whose arm_mass is stated: add the arm to the "
            "mass, or name arm_mass in fit as well"
        )


def start_values(
    key: str, bench: str, mechanism: Mechanism, recordings: Sequence[Recording]
) -> tuple[float, ...]:
    """Return one number of every joint of a bench; none where it has no such number."""
    stated = {
        numbers_of(key, override_mechanism(mechanism, r.bench_overrides))
        for r in recordings
        if r.bench == bench
    }
    if len(stated) > 1:
        listed = " and ".join(str(list(values)) for values in sorted(stated))
        raise InvalidModelFile(
            f"fit names {key!r}, so that all recordings of bench {bench!r} must start from one "
            f"value; they state {listed}"
        )
    (values,) = stated
    if any(value == 0.0 for value in values):
        raise InvalidModelFile(
            f"fit names {key!r}, whose search starts at the bench's own number; that of bench "
            f"{bench!r} is 0: give a likely one in bench_overrides"
        )
    return values


def numbers_of(key: str, mechanism: Mechanism) -> tuple[float, ...]:
    """Return a mechanism's numbers of one key, joint by joint; none where it has no such number.

    What no override can change is none. A routed tendon's sites would have to move with a length.
    """
    routed = any(tendon.route is not None for tendon in mechanism.tendons)
    if refusal_of(mechanism, key) or (routed and key == "length"):
        return ()
    if key == "moment_arm":
        return tuple(float(arm) for arm in mechanism.tendons[0].moment_arm)
    if key == "range":
        ends = [joint.limits[1] for joint in mechanism.joints]
        return tuple(ends) if np.isfinite(ends).all() else ()
    if key == "mass":
        return tuple(joint.mass - joint.arm_mass for joint in mechanism.joints)
    return tuple(getattr(joint, key) for joint in mechanism.joints)


def without_estimates(recording: Recording, model: Model) -> Recording:
    """Return a recording without those numbers that a model both declares unknown and gives.

    They are its estimates, and count more than what was believed when the recording was made.
    """
    given = model.bench_overrides.get(recording.bench, BenchOverrides()).given
    own = recording.bench_overrides.given
    kept = {key: value for key, value in own.items() if not (key in model.fit and key in given)}
    return recording if kept == own else replace(recording, bench_overrides=BenchOverrides(**kept))


def with_estimates(
    model: Model, numbers: Sequence[BenchNumber], values: Mapping[str, float]
) -> dict[str, BenchOverrides]:
    """Return a model's ``bench_overrides`` with fitted numbers, given by name, in place."""
    tables = {bench: dict(given.given) for bench, given in model.bench_overrides.items()}
    for number in (n for n in numbers if n.key != RADIUS):
        table = tables.setdefault(number.bench, {})
        same = [n for n in numbers if (n.bench, n.key) == (number.bench, number.key)]
        table[number.key] = tuple(values[n.name] for n in same)
    return {bench: BenchOverrides(**table) for bench, table in tables.items()}


def write_by_chain(
    arrays: dict[str, Array],
    numbers: Sequence[BenchNumber],
    values: Array,
    parents: Sequence[int],
    chain: Indices,
) -> None:
    """Write unknown numbers into the arrays of a mechanism of equal chains.

    All is as for `write_numbers`, each world one chain; `chain` tells which, shape (W,).
    """
    joints = len(parents)
    for k in np.unique(chain):
        worlds = chain == k
        own = [n.joint // joints == k or not n.bench for n in numbers]
        part = {name: array[worlds] for name, array in arrays.items()}
        local = [
            replace(n, joint=n.joint % joints) for n, mine in zip(numbers, own, strict=True) if mine
        ]
        write_numbers(part, local, values[worlds][:, own], parents)
        for name, array in arrays.items():
            array[worlds] = part[name]


def write_numbers(
    arrays: dict[str, Array], numbers: Sequence[BenchNumber], values: Array, parents: Sequence[int]
) -> None:
    """Write unknown numbers into the arrays of a mechanism.

    The arrays are the `WRITTEN` ones, shape (W, J, ...), (W, D, J) for the arms, and are changed in
    place. B numbers of this bench have values in every world, shape (W, B).
    """
    arms = [(values[:, c], n) for c, n in enumerate(numbers) if n.key == "arm_mass"]
    for _, number in arms:
        change_arm(arrays, number.joint, without_arm, np.array(number.value))
    for column, number in enumerate(numbers):
        value, j = values[:, column], number.joint
        if number.key == RADIUS:
            arrays[RADIUS][:] = value[:, None]
        elif number.key in ("stiffness", "damping"):
            arrays[number.key][:, j] = value
        elif number.key == "range":
            arrays["upper"][:, j] = value
        elif number.key == "moment_arm":
            arrays["arms"][:, 0, j] = value
        elif number.key == "mass":
            scale(arrays["inertia"], j, value / arrays["mass"][:, j])
            arrays["mass"][:, j] = value
        elif number.key == "length":
            stretch = value / number.value
            scale(arrays["inertia"], j, stretch**2)
            scale(arrays["centre"], j, stretch)
            for child in (c for c, parent in enumerate(parents) if parent == j):
                scale(arrays["offset"], child, stretch)
    for value, number in arms:
        change_arm(arrays, number.joint, with_arm, value)


def change_arm(
    arrays: dict[str, Array], j: int, change: Callable[[Body, Array], Body], arm: Array
) -> None:
    """Put an arm on joint j in every world, or take it off; its mass has shape (W,) or ()."""
    names = ("mass", "centre", "inertia")
    mass, centre, inertia = (arrays[name][:, j] for name in names)
    changed = change((mass, centre, inertia), np.broadcast_to(arm, mass.shape))
    for name, array in zip(names, changed, strict=True):
        arrays[name][:, j] = array


def scale(array: Any, j: int, factor: Array) -> None:
    """Multiply what belongs to joint j, shape (W, J, ...), by a factor per world."""
    array[:, j] *= factor.reshape(-1, *[1] * (array.ndim - 2))
