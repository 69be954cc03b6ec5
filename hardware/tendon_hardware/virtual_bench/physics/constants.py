"""Every constant of the virtual bench: nominal value, spread between units, unit and source.

A unit is drawn uniformly from nominal (1 +- spread), or from nominal +- half_width where a
relative spread means nothing. The numbers are frozen together with ``BENCH_SEEDS``: results on the
virtual bench may be compared between versions of everything else.

Sources named in short:
- e-manual: ROBOTIS e-manual, XC330-T288-T, https://emanual.robotis.com/docs/en/dxl/x/xc330-t288/
- BAM: Duclusaud et al., Extended Friction Models for the Physics Simulation of Servo Actuators
  (2025), and the parameter files published with it for an XL330-M288: the spread of its fits.
- paper: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), and the force
  network published with it.
- nominal bench: the numbers under ``assets/``, which every model of this repository starts from.
- assumed: no source; chosen within what printed parts and hobby electronics do, and said so.
"""

from dataclasses import dataclass, field
from math import pi
from typing import Any

BENCH_SEEDS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9)
"""The ten units that every published figure is a median of."""

TIME_STEP = 0.25e-3
"""Substep of the plant [s]; halving it changes the tension by less than 0.05 N RMS."""


def drawn(
    nominal: float, spread: float, unit: str, source: str, *, half_width: float | None = None
) -> Any:
    """Return a field whose value a unit draws about a nominal one.

    Args:
        nominal: Middle of the draw, and the value of a unit that draws nothing.
        spread: Relative half width of the uniform draw [1].
        half_width: Half width in the constant's own unit, in place of ``spread``.
    """
    width = abs(nominal) * spread if half_width is None else half_width
    return field(default=nominal, metadata={"width": width, "unit": unit, "source": source})


def drawn_each(nominal: tuple[float, ...], spread: float, unit: str, source: str) -> Any:
    """Return a field with a value for each joint or finger, drawn one by one."""
    width = tuple(abs(value) * spread for value in nominal)
    return field(default=nominal, metadata={"width": width, "unit": unit, "source": source})


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoConstants:
    """XC330-T288-T at its output shaft, gear included."""

    torque_constant: float = drawn(
        1.43, 0.05, "N m/A", "e-manual: 9.0 V at 52 rpm, less 0.08 A of no-load current"
    )
    resistance: float = drawn(15.0, 0.05, "ohm", "e-manual: 9.0 V / 0.61 A at stall, and leads")
    inertia: float = drawn(0.0025, 0.15, "kg m^2", "assumed: rotor of 3e-8 kg m^2 behind 288.4:1")
    dry_friction: float = drawn(
        0.016, 0.25, "N m", "BAM: 0.0048 to 0.0109 for XL330, times the ratio of stall torques 1.8"
    )
    stick_excess: float = drawn(0.35, 0.3, "1", "assumed: breakaway above dry friction")
    stribeck_speed: float = drawn(0.15, 0.5, "rad/s", "BAM: 0.10 to 2.89; the slow end")
    viscous_friction: float = drawn(
        0.008, 0.3, "N m s/rad", "XL330 logs: 0.0044; the e-manual's no-load speed asks for 0.010"
    )
    motor_load_friction: float = drawn(
        0.31, 0.08, "1", "BAM: 0.22 to 0.34; e-manual: 0.29 at stall"
    )
    tendon_load_friction: float = drawn(0.22, 0.15, "1", "BAM: 0 to 0.26")
    supply_voltage: float = drawn(9.0, 0.01, "V", "e-manual: lowest of its three rows")
    supply_resistance: float = drawn(0.6, 0.3, "ohm", "assumed: leads and power board")
    thermal_resistance: float = drawn(11.0, 0.15, "K/W", "assumed: winding to ambient, small case")
    thermal_time: float = drawn(260.0, 0.2, "s", "assumed")
    ambient: float = drawn(24.0, 0.0, "degC", "assumed", half_width=3.0)
    spool_radius: float = drawn(0.0125, 0.01, "m", "paper; printing tolerance")
    encoder_eccentricity: float = drawn(0.002, 0.8, "rad", "AS5601: up to 1 degree of nonlinearity")
    encoder_phase: float = drawn(0.0, 0.0, "rad", "assumed: any", half_width=pi)
    encoder_noise: float = drawn(0.00026, 0.3, "rad", "AS5601: 0.015 degrees RMS")
    velocity_lag: float = drawn(0.019, 0.08, "s", "XL330 logs: 19 to 21 ms behind the position")
    current_noise: float = drawn(0.003, 0.3, "A", "assumed")
    clock_error: float = drawn(0.0, 0.0, "1", "assumed: RC oscillator, trimmed", half_width=2e-3)
    voltage_ripple: float = drawn(
        0.25, 0.4, "V", "XL330 logs: the register scatters by 0.13 to 0.68 V at partial duty"
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class TendonConstants:
    """Braided line from the spool through the load cell and a guide to the mechanism."""

    spool_side_stiffness: float = drawn(
        14e3, 0.25, "N/m", "assumed: braided line of 0.1 m, load cell and mount"
    )
    mechanism_side_stiffness: float = drawn(18e3, 0.25, "N/m", "assumed: braided line of 0.1 m")
    slack: float = drawn(0.0004, 0.0, "m", "assumed: left when the operator homes", half_width=3e-4)
    guide_friction: float = drawn(
        0.05, 0.4, "1", "capstan: friction 0.1 of braid on PTFE over 30 degrees of wrap"
    )
    routing_friction: float = drawn(
        0.12, 0.4, "1", "capstan: friction 0.1 of braid on PTFE over 70 degrees inside a finger"
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class FingerConstants:
    """Two phalanges on flexible joints; [PIP, DIP] where there are two numbers."""

    lengths: tuple[float, float] = drawn_each((0.030, 0.025), 0.01, "m", "nominal bench")
    masses: tuple[float, float] = drawn_each((0.012, 0.008), 0.05, "kg", "nominal bench")
    moment_arms: tuple[float, float] = drawn_each((0.0080, 0.0055), 0.03, "m", "nominal bench")
    stiffness: tuple[float, float] = drawn_each((0.045, 0.030), 0.08, "N m/rad", "nominal bench")
    damping: tuple[float, float] = drawn_each((5e-4, 3e-4), 0.2, "N m s/rad", "nominal bench")
    limits: tuple[float, float] = drawn_each((1.75, 1.40), 0.02, "rad", "nominal bench")
    stop_stiffness: float = drawn(30.0, 0.0, "N m/rad", "nominal bench")
    stop_damping: tuple[float, float] = drawn_each((0.02, 0.004), 0.0, "N m s/rad", "nominal bench")
    maxwell_ratio: float = drawn(0.22, 0.3, "1", "assumed: TPU 95A relaxes by 15 to 30 %")
    maxwell_time: float = drawn(1.4, 0.4, "s", "assumed: TPU 95A within seconds")
    pad_stiffness: float = drawn(0.35, 0.3, "N m/rad", "assumed: TPU pads that meet at closure")
    pad_reach: float = drawn(0.20, 0.2, "rad", "assumed: pads meet this far before the stop")
    gravity: float = drawn(9.81, 0.0, "m/s^2", "nominal bench")
    tilt: float = drawn(0.0, 0.0, "rad", "assumed: the bench stands level", half_width=0.02)


@dataclass(frozen=True, kw_only=True, slots=True)
class AntagonistConstants:
    """Two phalanges between a flexor and an extensor; [MCP, PIP] where there are two numbers.

    At each joint a string runs from a guide before the axis to one behind it. The constants are the
    guides' distances from the axis, and the angle between them seen from the axis while the finger
    is straight.
    """

    lengths: tuple[float, float] = drawn_each((0.034, 0.026), 0.01, "m", "nominal bench")
    masses: tuple[float, float] = drawn_each((0.015, 0.009), 0.05, "kg", "nominal bench")
    flexor_before: tuple[float, float] = drawn_each(
        (0.014705, 0.012207), 0.02, "m", "nominal bench; 0.3 mm of print and line"
    )
    flexor_behind: tuple[float, float] = drawn_each((0.014422, 0.010929), 0.02, "m", "as before")
    flexor_angle: tuple[float, float] = drawn_each((1.93729, 1.92764), 0.01, "rad", "as before")
    extensor_before: tuple[float, float] = drawn_each((0.017889, 0.020742), 0.02, "m", "as before")
    extensor_behind: tuple[float, float] = drawn_each((0.015042, 0.010770), 0.02, "m", "as before")
    extensor_angle: tuple[float, float] = drawn_each((2.30361, 2.49272), 0.01, "rad", "as before")
    knuckles: tuple[float, float] = drawn_each((0.006, 0.0045), 0.02, "m", "as before")
    stiffness: tuple[float, float] = drawn_each((0.030, 0.020), 0.08, "N m/rad", "nominal bench")
    damping: tuple[float, float] = drawn_each((6e-4, 3e-4), 0.2, "N m s/rad", "nominal bench")
    limits: tuple[float, float] = drawn_each((1.5, 1.5), 0.02, "rad", "nominal bench")
    stop_stiffness: float = drawn(30.0, 0.0, "N m/rad", "nominal bench")
    stop_damping: tuple[float, float] = drawn_each((0.02, 0.005), 0.0, "N m s/rad", "nominal bench")
    maxwell_ratio: float = drawn(0.22, 0.3, "1", "assumed: TPU 95A relaxes by 15 to 30 %")
    maxwell_time: float = drawn(1.4, 0.4, "s", "assumed: TPU 95A within seconds")
    pad_stiffness: float = drawn(0.35, 0.3, "N m/rad", "assumed: TPU pads that meet at closure")
    pad_reach: float = drawn(0.20, 0.2, "rad", "assumed: pads meet this far before the stop")
    gravity: float = drawn(9.81, 0.0, "m/s^2", "nominal bench")
    tilt: float = drawn(0.0, 0.0, "rad", "assumed: the bench stands level", half_width=0.02)


@dataclass(frozen=True, kw_only=True, slots=True)
class HandConstants:
    """Four fingers in front of one palm, each with its servo; what a unit has of the asset's [1].

    The asset's own numbers stand in the scene's file. Each of four numbers belongs to one tendon's
    finger.
    """

    masses: tuple[float, ...] = drawn_each((1.0,) * 4, 0.05, "1", "printing tolerance")
    stiffness: tuple[float, ...] = drawn_each((1.0,) * 4, 0.08, "1", "as of the finger's springs")
    damping: tuple[float, ...] = drawn_each((1.0,) * 4, 0.2, "1", "as of the finger's joints")
    tilt: float = drawn(0.0, 0.0, "rad", "assumed: the bench stands level", half_width=0.02)


@dataclass(frozen=True, kw_only=True, slots=True)
class HandBallConstants(HandConstants):
    """A hand with a ball in a cup on its palm, and a camera that looks at the ball."""

    ball_mass: float = drawn(1.0, 0.1, "1", "assumed: balls of one kind, as sold")
    ball_friction: float = drawn(1.0, 0.2, "1", "assumed: rubber on printed fingers, dust")
    cup_friction: float = drawn(1.0, 0.3, "1", "assumed: polished plastic, dust")
    camera_noise: float = drawn(1.0e-3, 0.5, "m", "assumed: a blob of some 20 pixels at 640 x 480")
    camera_delay: float = drawn(
        0.075, 0.0, "s", "assumed: exposure, readout and search of a frame", half_width=0.025
    )
    camera_rate: float = drawn(30.0, 1e-4, "Hz", "assumed: a camera's own crystal")


@dataclass(frozen=True, kw_only=True, slots=True)
class SliderConstants:
    """A carriage on a horizontal rail, pulled against a coil spring."""

    mass: float = drawn(0.05, 0.05, "kg", "nominal bench")
    stiffness: float = drawn(200.0, 0.04, "N/m", "nominal bench")
    damping: float = drawn(5.0, 0.2, "N s/m", "nominal bench")
    rail_friction: float = drawn(
        0.15, 0.4, "N", "assumed: 0.05 kg on a printed rail, and its guide"
    )
    travel: float = drawn(0.08, 0.0, "m", "nominal bench")
    stop_stiffness: float = drawn(1.5e5, 0.0, "N/m", "nominal bench")
    stop_damping: float = drawn(80.0, 0.0, "N s/m", "nominal bench")


@dataclass(frozen=True, kw_only=True, slots=True)
class LoadCellConstants:
    """5 kg bar cell, HX711 at gain 128, and the microcontroller that reads it."""

    counts_per_newton: float = drawn(42.7e3, 0.12, "1/N", "1 mV/V cell on 4.3 V, 20 mV full scale")
    offset: float = drawn(0.0, 0.0, "1", "assumed: bridge imbalance", half_width=250e3)
    noise: float = drawn(0.012, 0.3, "N", "HX711: 90 nV RMS at 80 SPS, ten times that on a module")
    drift: float = drawn(0.0, 0.0, "N/s", "assumed: cell and amplifier warm up", half_width=1e-4)
    wander: float = drawn(0.0015, 0.3, "N/sqrt(s)", "assumed: drafts")
    clock_error: float = drawn(0.0, 0.0, "1", "crystal of the microcontroller", half_width=100e-6)
    rate_error: float = drawn(0.0, 0.0, "1", "HX711: internal oscillator", half_width=0.02)
