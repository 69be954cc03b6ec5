"""The table of public reports of other projects, each by the tests that hold its right outcome."""

import pytest

from tests.doors.told import EVERY


def told(name: str) -> tuple[str, ...]:
    """Return the tests of a mistake in recorded data, one for each door."""
    (mistake,) = (mistake for mistake in EVERY if mistake.name == name)
    test = "doors/test_doors.py::test_a_mistake_gets_a_line_with_its_mend"
    return tuple(f"{test}[{name}, {door}]" for door in mistake.doors)


GOES = "exports/test_every_export.py::test_a_bench_goes_to_every_program"
REPORTS: dict[str, tuple[str, ...]] = {
    "gazebosim/gz-mujoco#8: two shapes of one name": (f"{GOES}[finger_antagonist-ideal]",),
    "mujoco_warp#287: armature on a wrapped string": (f"{GOES}[finger_routed-pwm_servo]",),
    "mujoco#694: a string that is let go is loose": (f"{GOES}[finger-pwm_servo]",),
    "mujoco#1704: a string that stretches only pulls": (
        "exports/test_one_law.py::test_a_string_that_stretches_carries_at_rest_what_its_motor_gives"
        "[mujoco: tendon_step.py]",
    ),
    "newton#4013: mimic and equality (refused)": (
        "mechanisms/test_asset_command.py::test_a_joint_that_mimics_another_is_refused",
    ),
    "DynamixelSDK#256: zeros or a neighbour's angle": (
        *told("zeros where the bus read nothing"),
        *told("a neighbour's angle"),
        *told("zeros in every fifth row"),
    ),
    "lerobot#930: a joint reversed": told("a joint reversed"),
    "lerobot#3280: a frozen reading": told("300 rows frozen"),
    "rosclaw#588: nothing moved": (*told("nothing moves"), *told("half a count moves")),
    "DynamixelSDK#281: -1 reads 65535": told("an unsigned load of a coarse count"),
    "HX711_ADC#80: a negative tension": told("a negative tension"),
    "counts with a sign bit": told("a load as size and sign"),
    "the encoder's seam inside the range": told("the encoder's seam inside the range"),
    "relative actions": told("actions relative to the angle"),
    "a clock that begins again": told("a clock that begins again"),
    "reads slower than rows": told("the last reading again"),
    "stamps that jitter": ("formats/test_recording.py::test_uneven_sampling_and_gaps_are_legal",),
    "a servo's profile": (
        "physics/servos/test_position_servo.py::test_a_profile_speeds_up_and_slows_down",
    ),
    "play of a joint": (
        "importers/test_lerobot_examination.py::test_what_was_planted_in_a_joint_is_told",
    ),
    "cut files of MCAP": (
        "formats/test_mcap.py::test_a_file_cut_anywhere_is_read_in_part_or_refused",
    ),
    "wild stamps and flipped bits": (
        "formats/test_mcap.py::test_flipped_bits_never_change_what_is_read",
        "formats/test_mcap.py::test_readings_out_of_order_are_sorted",
    ),
    "pace-sim2real#19: a joint rings, its model does not": (
        "diagnosis/test_richer_actuator.py::test_numbers_that_nobody_stated_well_are_fitted",
    ),
    "detents of a gear": ("diagnosis/test_structure.py::test_cogging_is_seen_where_it_sits",),
    "friction through the readers of Isaac": (
        "exports/test_urdf.py::test_friction_comes_through_the_readers_of_isaac",
    ),
    "an ONNX file against its policy": (
        "train/policy/test_learned_policy.py"
        "::test_both_files_carry_the_card_and_act_as_in_training",
    ),
    "spikes of a cell": (
        "hardware/load_cells/test_cell_doubt.py"
        "::test_two_saturated_readings_are_a_spike_and_three_a_fault",
    ),
}
"""Report, with its thread where it is named -> its tests."""
TRIED = 26  # Public reports that were tried; the rest have no input made in a test


class Outcomes:
    """What became of each test that ran."""

    def __init__(self) -> None:
        self.failed: set[str] = set()
        self.ran: set[str] = set()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the outcome of a step of a test."""
        name = report.nodeid.removeprefix("tests/")
        self.ran |= {name} if report.when == "call" and not report.skipped else set()
        self.failed |= {name} if report.failed else set()


def rows_of_reports() -> list[str]:
    """Run the tests of every report and return a row for each, and how many are right."""
    nodes = sorted({f"tests/{test}" for tests in REPORTS.values() for test in tests})
    outcomes = Outcomes()
    pytest.main(["-q", "--no-header", "-p", "no:cacheprovider", *nodes], plugins=[outcomes])
    rows: list[str] = []
    for report, tests in REPORTS.items():
        ran = {
            test: {name for name in outcomes.ran if name == test or name.startswith(f"{test}[")}
            for test in tests
        }
        right = all(names and not names & outcomes.failed for names in ran.values())
        rows.append(f"{'right' if right else 'WRONG':6s} {report}")
    right = sum(row.startswith("right") for row in rows)
    return [*rows, f"{right} of {TRIED} reports right, {TRIED - len(REPORTS)} without a row"]
