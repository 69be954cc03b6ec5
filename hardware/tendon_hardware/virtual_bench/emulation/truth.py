"""What a unit really is, as a file: its constants, and the named effects that they amount to.

The names and parameters of the effects are those by which a diagnosis reports, so that its answer
for a recording of this unit can be scored. An effect without parameters is there, but has none
that could be compared one to one. With several servos the effects are those of the first.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from tendon_hardware.virtual_bench.physics.constants import HandConstants, SliderConstants
from tendon_hardware.virtual_bench.physics.load_cell import FILTER
from tendon_hardware.virtual_bench.physics.obstacle import NOMINAL_SPOOL
from tendon_hardware.virtual_bench.physics.unit import BENCHES, BenchUnit, draw_unit
from tendon_newton.data.files.toml_file import write_toml

CELL_PERIOD = 1.0 / 80.0  # [s]


def write_plant_file(path: Path, unit: BenchUnit) -> None:
    """Write every constant of a unit and the effects that they amount to."""
    table: dict[str, Any] = {"bench": unit.bench, "seed": unit.seed}
    for part in ("servo", "tendon", "mechanism", "load_cell"):
        table[part] = listed_values(getattr(unit, part))
    for place, line in enumerate(unit.further, start=1):
        for part in ("servo", "tendon", "load_cell"):
            table[f"{part}_{place}"] = listed_values(getattr(line, part))
    effects = actuator_effects(unit) + transmission_effects(unit)
    effects += mechanism_effects(unit) + sensor_effects(unit)
    rows = [{"name": n, **({"parameters": values} if values else {})} for n, values in effects]
    write_toml(path, table, effects=rows)


def listed_values(constants: Any) -> dict[str, Any]:
    """Return constants as a file of text holds them."""
    values: dict[str, Any] = asdict(constants)
    return {k: [*v] if isinstance(v, tuple) else v for k, v in values.items()}


Effect = tuple[str, dict[str, float]]


def actuator_effects(unit: BenchUnit) -> list[Effect]:
    """Return what lies between the command and the load cell.

    Friction by load is what `load_dependent_friction` amounts to, and all that stands before it
    what it then has to be; see `quasi_static_gear`.
    """
    c = unit.servo
    coefficient, gain = quasi_static_gear(c.motor_load_friction, c.tendon_load_friction)
    share = 1.0 / (1.0 + c.motor_load_friction * c.tendon_load_friction)
    dry = share * c.dry_friction / c.spool_radius
    return [
        ("command_delay", {}),  # where the host closes the loop: its duty stands for 50 ms
        (
            "stribeck_friction",
            {
                "coulomb_force": dry,
                "static_force": dry * (1.0 + c.stick_excess),
                "stribeck_velocity": c.stribeck_speed,
            },
        ),
        ("viscous_friction", {"coefficient": share * c.viscous_friction / c.spool_radius}),
        ("load_dependent_friction", {"coefficient": coefficient}),
        ("holding_friction", {}),
        ("voltage_sag", {}),
        ("gain_error", {"scale": gain}),  # beside the unit's own motor constants
    ]


def transmission_effects(unit: BenchUnit) -> list[Effect]:
    """Return what lies between spool and mechanism."""
    t = unit.tendon
    stiffness = 1.0 / (1.0 / t.spool_side_stiffness + 1.0 / t.mechanism_side_stiffness)
    return [
        ("tendon_slack", {"length": t.slack}),
        ("tendon_compliance", {"stiffness": stiffness}),
        ("routing_friction", {"exponent": t.guide_friction + t.routing_friction}),
        ("spool_radius_error", {"scale": unit.servo.spool_radius / NOMINAL_SPOOL}),
    ]


def mechanism_effects(unit: BenchUnit) -> list[Effect]:
    """Return how the mechanism differs from its nominal numbers."""
    c, nominal = unit.mechanism, BENCHES[unit.bench]
    if isinstance(c, SliderConstants) and isinstance(nominal, SliderConstants):
        dry = c.rail_friction / (nominal.stiffness * nominal.travel)
        return [
            ("joint_stiffness_error", {"scale": c.stiffness / nominal.stiffness}),
            ("joint_damping_error", {"scale": c.damping / nominal.damping}),
            ("inertia_error", {"scale": c.mass / nominal.mass}),
            ("joint_dry_friction", {"fraction": dry}),
        ]
    assert not isinstance(c, SliderConstants)
    assert not isinstance(nominal, SliderConstants)
    own: list[Effect] = [
        ("joint_stiffness_error", {"scale": ratio(c.stiffness, nominal.stiffness)}),
        ("joint_damping_error", {"scale": ratio(c.damping, nominal.damping)}),
        ("inertia_error", {"scale": ratio(c.masses, nominal.masses)}),
        ("gravity_misalignment", {"angle": c.tilt}),
    ]
    if isinstance(c, HandConstants):
        return own
    return [
        *own[:-1],
        (
            "viscoelastic_spring",
            {"stiffness_ratio": c.maxwell_ratio, "relaxation_time": c.maxwell_time},
        ),
        ("spring_stiffening", {}),
        own[-1],
    ]


def sensor_effects(unit: BenchUnit) -> list[Effect]:
    """Return what the sensors add, once the cell is calibrated as it was drawn."""
    late = CELL_PERIOD * (0.5 + sum(k * weight for k, weight in enumerate(FILTER)))
    cell = unit.load_cell.counts_per_newton
    calibrated = draw_unit(unit.bench, unit.seed).load_cell.counts_per_newton
    gain: list[Effect] = [("load_cell_gain", {"scale": cell / calibrated})]
    return [
        *(gain if cell != calibrated else []),
        ("load_cell_delay", {"delay": late}),
        ("load_cell_drift", {"rate": unit.load_cell.drift}),
        ("position_offset", {}),
    ]


def ratio(values: tuple[float, ...], nominal: tuple[float, ...]) -> float:
    """Return the mean ratio of joints' or fingers' values to their nominal ones [1]."""
    return sum(v / n for v, n in zip(values, nominal, strict=True)) / len(values)


def quasi_static_gear(motor: float, load: float) -> tuple[float, float]:
    r"""Return what friction by both sides' load amounts to beside friction by the output's load.

    A gear that loses :math:`c_m |F_m| + c_e F` and a friction :math:`C` gives, at a constant speed
    on the side :math:`s = \pm 1`,

    .. math:: F = \frac{(1 - s c_m) F_m - s C}{1 + s c_e}
        = \frac{g F_m - s C'}{1 + s \mu}, \quad
        \mu = \frac{c_m + c_e}{1 + c_m c_e}, \quad g = \frac{1 - c_m^2}{1 + c_m c_e}

    since :math:`(1 + s c_m)(1 + s c_e) = (1 + c_m c_e)(1 + s \mu)`: `load_dependent_friction` of
    :math:`\mu` on a motor whose force is :math:`g` times as large. Both hold for winding in and
    for winding out; :math:`C' = C (1 + s c_m) / (1 + c_m c_e)` is :math:`C / (1 + c_m c_e)` in the
    mean of the two. With :math:`c_m = c_e = K` it is `gear_load_friction`.

    Args:
        motor: c_m, friction by what the motor presses the gear's teeth with [1].
        load: c_e, friction by what the tendon presses them with [1].

    Returns:
        Coefficient mu and gain g [1].
    """
    both = 1.0 + motor * load
    return (motor + load) / both, (1.0 - motor * motor) / both
