"""Mistakes that some test must notice: each is made in a copy of the tree, and a failure expected.

Usage: ``.venv/bin/python -m tests.mutations [NAME ...] [--list]``. A copy of the working tree is
made. For each entry its tests must pass there, and fail once its mistake is made, alone. Entries
are mistakes that once passed unnoticed, and the like.
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.search_path import search_path

ROOT = Path(__file__).resolve().parents[1]
NOT_COPIED = (".git", ".venv", "build", "dist", "*.egg-info", ".*_cache", "__pycache__")
NOT_NOTICED, NOTICED = 0, 1
"""Exit codes of pytest: all passed, and some failed; others say that nothing was tested."""


@dataclass(frozen=True, kw_only=True)
class Mutation:
    """One mistake and the tests that must notice it."""

    name: str
    file: str
    """Where it is made, from the root of the tree."""
    old: str
    """Text that stands there once."""
    new: str
    """Text that takes its place."""
    tests: str
    """Selection of pytest, as narrow as it can be."""


ARMS = "tests/arms/test_arms.py -k"
HELD_OUT = "tests/test_held_out.py -k"
PWM = "tests/physics/servos/test_pwm_servo.py"
FIRMWARE = "tests/physics/servos/test_firmware_effects.py -k"
PHYSICS = "tests/physics/test_effects_physics.py -k"
SETS = "tests/diagnosis/search/test_sets.py -k"
CHANGES = "tests/diagnosis/in_time/test_changes.py -k"
EVENTS = "tests/diagnosis/in_time/test_log_events.py -k"
NOT_NAMED = "tests/diagnosis/test_not_named.py -k"
TURNING = "tests/train/policy/test_turning_parts.py -k"

MUTATIONS: tuple[Mutation, ...] = (
    # arms
    Mutation(
        name="base-tipped-the-other-way",
        file="tendon_newton/arms/placement.py",
        old=".as_matrix().T @ gravity",
        new=".as_matrix() @ gravity",
        tests=f"{ARMS} tipped",
    ),
    Mutation(
        name="arm-without-a-load-has-a-best-sign",
        file="tendon_newton/arms/placement.py",
        old="if costs[s] <= most)",
        new="if costs[s] < most)",
        tests=f"{ARMS} stand_still",
    ),
    Mutation(
        name="stated-lag-twice",
        file="tendon_newton/arms/known_arm.py",
        old=" and e.cause not in stated",
        new="",
        tests=f"{ARMS} added_once",
    ),
    Mutation(
        name="floor-without-force",
        file="tendon_newton/arms/arm_simulation.py",
        old="SHARE * below",
        new="0.0 * below",
        tests=f"{ARMS} together",
    ),
    Mutation(
        name="floor-pushes-what-does-not-give-way",
        file="tendon_newton/arms/arm_simulation.py",
        old="felt = lifted > LEAST_LIFT",
        new="felt = lifted >= 0.0",
        tests=f"{ARMS} gives_way",
    ),
    # held out
    Mutation(
        name="test-recordings-fitted",
        file="tendon_newton/diagnosis/diagnose.py",
        old="train = Study(\n        dataset.train,",
        tests=f"{HELD_OUT} diagnose",
        new="train = Study(\n        (*dataset.train, *dataset.test),",
    ),
    Mutation(
        name="test-recordings-of-a-day-fitted",
        file="tendon_newton/workflows/diagnosing.py",
        old="first, day.train, unseen",
        new="first, (*day.train, *day.test), unseen",
        tests=f"{HELD_OUT} against",
    ),
    Mutation(
        name="what-both-days-lack-has-moved",
        file="tendon_newton/diagnosis/in_time/changes.py",
        old="if lacking := alone.search():",
        new="if lacking := frozenset[str]():",
        tests=f"{CHANGES} lacks",
    ),
    Mutation(
        name="moved-inside-its-interval",
        file="tendon_newton/diagnosis/in_time/changes.py",
        old="kept = frozenset(name for name in moved if not point.holds_before(name))",
        new="kept = moved",
        tests=f"{CHANGES} answer",
    ),
    Mutation(
        name="first-day-is-certain",
        file="tendon_newton/diagnosis/in_time/changes.py",
        old="return abs(high - low) / (2.0 * SURE)",
        new="return 1.0e-6 * abs(high - low)",
        tests=f"{CHANGES} answer",
    ),
    Mutation(
        name="an-angle-skips-unseen",
        file="tendon_newton/diagnosis/in_time/log_events.py",
        old="if shares[at] <= LEAST_JUMP:",
        new="if shares[at] <= 3.0 * LEAST_JUMP:",
        tests=f"{EVENTS} skipped",
    ),
    Mutation(
        name="usual-error-is-an-event",
        file="tendon_newton/diagnosis/in_time/log_events.py",
        old="if abs(out[peak]) <= PULSE_MARGIN * calm.pulse:",
        new="if abs(out[peak]) <= 0.5 * calm.pulse:",
        tests=f"{EVENTS} silent",
    ),
    Mutation(
        name="step-is-no-event",
        file="tendon_newton/diagnosis/in_time/log_events.py",
        old="if step > LASTS * calm.step else",
        new="if step > 500.0 * calm.step else",
        tests=f"{EVENTS} slipped",
    ),
    Mutation(
        name="a-beginning-is-calm",
        file="tendon_newton/diagnosis/in_time/balance.py",
        old="pace = np.full_like(command, np.ptp(command))",
        new="pace = np.zeros_like(command)",
        tests=f"{EVENTS} beginning",
    ),
    Mutation(
        name="a-knock-is-no-force",
        file="tendon_newton/diagnosis/in_time/log_events.py",
        old="more[there, servo] = force",
        new="more[there, servo] = 0.5 * force",
        tests=f"{EVENTS} knocked",
    ),
    Mutation(
        name="what-is-told-is-looked-for",
        file="tendon_newton/workflows/refreshing.py",
        old="drift = find_wear(options, operator) if changes is None else told_drift(changes)",
        new="drift = find_wear(options, operator)",
        tests="tests/train/refresh/test_drift.py -k told",
    ),
    Mutation(
        name="any-file-is-a-recording",
        file="tendon_newton/workflows/diagnosing.py",
        old="own = tuple(r for r in (*day.train, *day.test) if r.name == path.name)",
        new="own = day.train",
        tests="tests/diagnosis/in_time/test_comparing_days.py -k doctor",
    ),
    Mutation(
        name="short-runs-tell-of-steps",
        file="tendon_newton/diagnosis/in_time/log_events.py",
        old="if own.time[-1] - own.time[0] > 2.0 * SIDE",
        new="if own.time[-1] - own.time[0] > SIDE",
        tests=f"{EVENTS} short",
    ),
    Mutation(
        name="an-answer-about-all-is-about-none",
        file="tendon_newton/diagnosis/in_time/changes.py",
        old=" or self.estimates.get(effect_of(owner), {})",
        new=" or {}",
        tests=f"{CHANGES} all_servos",
    ),
    Mutation(
        name="another-bench-is-a-day",
        file="tendon_newton/workflows/diagnosing.py",
        old="if own and other:",
        new="if own and other and len(own) > 1:",
        tests="tests/test_mistakes.py -k another",
    ),
    Mutation(
        name="other-numbers-stand-still",
        file="tendon_newton/diagnosis/in_time/changes.py",
        old="moved, probability = name in point.moved,",
        new="moved, probability = True,",
        tests=f"{CHANGES} nothing_else",
    ),
    Mutation(
        name="held-out-errors-on-train",
        file="tendon_newton/diagnosis/diagnose.py",
        old="test = Study(dataset.test, model,",
        new="test = Study(dataset.train, model,",
        tests=f"{HELD_OUT} diagnose",
    ),
    Mutation(
        name="inner-folds-see-everything",
        file="tendon_newton/diagnosis/search/refit.py",
        old="chosen = own if rows is None else own & rows",
        new="chosen = own",
        tests="tests/diagnosis/search/test_refit.py",
    ),
    Mutation(
        name="tendon-decided-by-test",
        file="train/tendon_train/tendon/tendon_fit.py",
        old="return self.unseen_after < self.unseen_before",
        new="return self.error_after < self.error_before",
        tests=f"{HELD_OUT} fit-tendon",
    ),
    Mutation(
        name="string-judged-on-what-it-was-fitted-to",
        file="train/tendon_train/tendon/tendon_fit.py",
        old="fitted = others or own",
        new="fitted = [piece for part in parts for piece in part]",
        tests="tests/train/tendon/test_tendon_fit.py -k unseen",
    ),
    Mutation(
        name="drift-decided-by-held-out-ends",
        file="train/tendon_train/refresh/drift.py",
        old="(now.train, model) / max(model_error(earlier.train, model)",
        new="(now.test, model) / max(model_error(earlier.test, model)",
        tests=f"{HELD_OUT} refresh",
    ),
    Mutation(
        name="refresh-fits-whole-logs",
        file="train/tendon_train/refresh/refresh_logs.py",
        old="    return cut(recordings)[0]\n",
        new="    return tuple(without_beginning(recording) for recording in recordings)\n",
        tests=f"{HELD_OUT} refresh",
    ),
    Mutation(
        name="import-starts-from-test-logs",
        file="tendon_newton/data/importers/writing.py",
        old="imported.start_model(split.train)",
        new="imported.model",
        tests=f"{HELD_OUT} import",
    ),
    Mutation(
        name="validation-recordings-fitted",
        file="train/tendon_train/actuator/samples/folds.py",
        old="fit=tuple(r for r in recordings if r.name not in held)",
        new="fit=tuple(recordings)",
        tests="tests/train/actuator/test_windows.py -k validation",
    ),
    Mutation(
        name="cut-log-shares-rows",
        file="tendon_newton/identification/cutting.py",
        old="rows_of(recording, slice(row, recording.sample_count)",
        new="rows_of(recording, slice(row - 40, recording.sample_count)",
        tests="tests/identification/test_noise_floor.py",
    ),
    # what is certain
    Mutation(
        name="intervals-four-times-too-wide",
        file="tendon_newton/identification/intervals.py",
        old="WIDENING = 3.0",
        new="WIDENING = 9.0",
        tests="tests/identification/test_intervals.py",
    ),
    Mutation(
        name="intervals-half-as-wide",
        file="tendon_newton/identification/intervals.py",
        old="WIDENING = 3.0",
        new="WIDENING = 0.75",
        tests="tests/identification/test_intervals.py",
    ),
    Mutation(
        name="price-per-cause",
        file="tendon_newton/diagnosis/search/pool.py",
        old="return self.price * len(law_of(name).parameters)",
        new="return self.price",
        tests=f"{SETS} its_price",
    ),
    Mutation(
        name="refused-causes-have-weight",
        file="tendon_newton/diagnosis/search/decide/fitted_sets.py",
        old="if not key & set(refused)",
        new="if True",
        tests=f"{SETS} as_probable",
    ),
    Mutation(
        name="named-though-unseen-parts-refuse-it",
        file="tendon_newton/diagnosis/search/decide/decision.py",
        old="if not ended and worths[worst] >= 1.0:",
        new="if not ended:",
        tests=f"{NOT_NAMED} contradict",
    ),
    Mutation(
        name="named-at-the-edge-of-its-range",
        file="tendon_newton/diagnosis/search/decide/decision.py",
        old="ended = [n for n in final.names if at_bound(decisive, final, n)]",
        new="ended: list[str] = []",
        tests=f"{NOT_NAMED} edge",
    ),
    Mutation(
        name="named-though-left-open",
        file="tendon_newton/diagnosis/search/decide/fitted_sets.py",
        old="else low <= p.null <= high",
        new="else False",
        tests=f"{SETS} holds_none",
    ),
    Mutation(
        name="stated-numbers-are-free",
        file="tendon_newton/diagnosis/search/search_worlds.py",
        old="return stated - WITHIN * spread, stated + WITHIN * spread",
        new="return stated - 99.0 * spread, stated + 99.0 * spread",
        tests=f"{SETS} beyond_its_tolerance",
    ),
    Mutation(
        name="parts-tell-of-what-they-do-not-show",
        file="tendon_newton/diagnosis/search/held_out_gain.py",
        old="shares < TOLD",
        new="shares < 0.0",
        tests=f"{SETS} left_out",
    ),
    Mutation(
        name="little-is-enough-beside-what-is-left",
        file="tendon_newton/diagnosis/search/decide/account.py",
        old="else SURE * decisive.price",
        new="else 0.0",
        tests=f"{SETS} three_prices",
    ),
    Mutation(
        name="hardly-a-gap-decides",
        file="tendon_newton/diagnosis/evaluation.py",
        old="HARDLY_ANY = 0.02",
        new="HARDLY_ANY = 0.0",
        tests="tests/diagnosis/test_evaluation.py",
    ),
    Mutation(
        name="only-what-is-named-is-written",
        file="tendon_newton/diagnosis/search/decide/decision.py",
        old="if found is not None and found.sum() < predicts:",
        new="if found is not None and found.sum() > predicts:",
        tests="tests/diagnosis/search/test_sets.py -k predict",
    ),
    Mutation(
        name="what-predicts-best-is-dropped",
        file="tendon_newton/diagnosis/diagnose.py",
        old="written = final and (findings.predictor or final)",
        new="written = final",
        tests="tests/diagnosis/search/test_sets.py -k written",
    ),
    Mutation(
        name="another-bench-has-only-aged",
        file="tendon_newton/diagnosis/in_time/changes_report.py",
        old="STRANGE = 3.0",
        new="STRANGE = 300.0",
        tests="tests/diagnosis/in_time/test_changes.py -k doubted",
    ),
    Mutation(
        name="slow-cells-may-not-jump",
        file="hardware/tendon_hardware/load_cells/cell_doubt.py",
        old="FAST = 60.0",
        new="FAST = 1.0",
        tests="tests/hardware/load_cells/test_cell_doubt.py -k jump",
    ),
    Mutation(
        name="letting-out-a-little-excuses-a-dead-cell",
        file="hardware/tendon_hardware/load_cells/cell_doubt.py",
        old="LET_OUT = 2.0",
        new="LET_OUT = 2000.0",
        tests="tests/hardware/load_cells/test_cell_doubt.py -k lets_out",
    ),
    Mutation(
        name="what-ended-at-an-edge-is-written",
        file="tendon_newton/diagnosis/search/decide/decision.py",
        old=" and not beyond & set(f.names)",
        new="",
        tests="tests/diagnosis/search/test_sets.py -k predict",
    ),
    Mutation(
        name="a-register-is-a-cause",
        file="tendon_newton/identification/testable.py",
        old="if name in study.exact:",
        new="if not name:",
        tests="tests/diagnosis/search/test_sets.py -k exactly",
    ),
    Mutation(
        name="sliding-sticks-more",
        file="tendon_newton/effects/stribeck_friction.py",
        old="if values[1] > values[0]:",
        new="if values[1] != values[0]:",
        tests="tests/physics/test_effects_physics.py -k stribeck",
    ),
    Mutation(
        name="recordings-that-differ-are-blocks-of-time",
        file="tendon_newton/identification/intervals.py",
        old="by_recording = half_width(point, where.recording, spread, together)",
        new="by_recording = by_block",
        tests=f"{NOT_NAMED} changes",
    ),
    Mutation(
        name="few-recordings-have-a-normal-quantile",
        file="tendon_newton/identification/intervals.py",
        old="stdtrit(count - 1, 0.5 * (1.0 + LEVEL))",
        new="stdtrit(1e6, 0.5 * (1.0 + LEVEL))",
        tests="tests/identification/test_intervals.py -k student",
    ),
    Mutation(
        name="large-class-is-an-answer",
        file="lab/tendon_lab/exam/exam_score.py",
        old="c if len(c) <= LARGEST_CLASS else c[:1]",
        new="c",
        tests="tests/lab/exam/test_exam_report.py",
    ),
    Mutation(
        name="run-whose-worst-case-was-not-looked-at",
        file="tendon_newton/diagnosis/next_experiment/worst_case.py",
        old="            kept += good\n",
        new="            kept += own[begin:]\n",
        tests="tests/diagnosis/next_experiment/test_run_design.py -k looked_at",
    ),
    Mutation(
        name="run-of-a-further-attempt-counts-as-missing",
        file="hardware/tendon_hardware/collection/collect_plan.py",
        old='    return {AGAIN.sub("", Path(file).stem) for file in listed_files(out)}',
        new="    return {Path(file).stem for file in listed_files(out)}",
        tests="tests/diagnosis/next_experiment/test_investigation.py -k 'fault_ends and alive'",
    ),
    # physics, sensors, gradients
    Mutation(
        name="delay-in-whole-rows",
        file="tendon_newton/effects/command_delay.py",
        old="return time - values[0]",
        new="return time - real(int(values[0] * real(80.0) + real(0.5))) / real(80.0)",
        tests=f"{PHYSICS} delay",
    ),
    Mutation(
        name="back-emf-five-per-cent",
        file="tendon_newton/actuators/pwm_servo.py",
        old="tendon.angle_rate * p[3])",
        new="tendon.angle_rate * p[3] * real(1.05))",
        tests=PWM,
    ),
    Mutation(
        name="rotor-twice",
        file="tendon_newton/actuators/pwm_servo.py",
        old="return p[5]",
        new="return real(2.0) * p[5]",
        tests=PWM,
    ),
    Mutation(
        name="gear-on-the-motors-side",
        file="tendon_newton/law/gear.py",
        old="probe = tendon.carried",
        new="probe = motor[0]",
        tests=f"{FIRMWARE} falling",
    ),
    *(
        Mutation(
            name=f"string-drives-its-spool-in-{engine}",
            file="tendon_newton/law/spool.py",
            old="Jet(motor[0] - taken",
            new="Jet(motor[0] + taken",
            tests=f"tests/exports/test_one_law.py -k {engine}",
        )
        for engine in ("rollout", "mujoco", "newton")
    ),
    Mutation(
        name="overload-never-ends",
        file="tendon_newton/effects/overload_cut.py",
        old="turned = duty[0] * lasted < real(0.0)",
        new="turned = duty[0] * lasted < real(-1.0e9)",
        tests=f"{FIRMWARE} other_side",
    ),
    Mutation(
        name="profile-brakes-too-late",
        file="tendon_newton/effects/acceleration_limit.py",
        old="top = wp.min(wp.sqrt(reach), values[1])",
        new="top = wp.min(wp.sqrt(real(2.0) * reach), values[1])",
        tests=f"{FIRMWARE} trapezoid",
    ),
    Mutation(
        name="heat-linear-in-force",
        file="tendon_newton/effects/torque_fade.py",
        old="settled = values[0] * force * force",
        new="settled = values[0] * wp.abs(force)",
        tests=f"{PHYSICS} fades",
    ),
    Mutation(
        name="offset-the-other-way",
        file="tendon_newton/effects/position_offset.py",
        old="return angle + Jet(values[0]",
        new="return angle - Jet(values[0]",
        tests="tests/physics/test_sensor_effects_physics.py -k offset",
    ),
    Mutation(
        name="contact-that-does-not-damp-along",
        file="tendon_newton/simulation/contact/contacts.py",
        old="c_t = real(SHEAR) * chi * elastic",
        new="c_t = real(0.0) * chi * elastic",
        tests="tests/physics/contact/test_free_bodies.py -k rocks",
    ),
    Mutation(
        name="gradient-one-per-cent-short",
        file="tendon_newton/gradients/trajectory_gradient.py",
        old="plain_tensor(input_array(rollout, name).grad)",
        new="(0.99 * plain_tensor(input_array(rollout, name).grad))",
        tests="tests/physics/gradients/test_learned_gradients.py -k torch_reaches",
    ),
    Mutation(
        name="sensor-noise-too-small",
        file="tendon_newton/identification/noise_floor.py",
        old="/ np.sqrt(6.0))",
        new="/ np.sqrt(12.0))",
        tests="tests/identification/test_noise_floor.py",
    ),
    # networks and policies
    Mutation(
        name="network-input-unscaled",
        file="tendon_newton/force_networks/force_network.py",
        old="- self.input_mean) / self.input_scale",
        new="- self.input_mean)",
        tests="tests/train/actuator/test_networks.py -k 'normalisation or about_one'",
    ),
    Mutation(
        name="network-scale-not-taken",
        file="tendon_newton/force_networks/force_network.py",
        old="self.input_scale.copy_(inputs.std(dim=0).clamp_min(1.0e-6))",
        new="self.input_scale.fill_(1.0)",
        tests="tests/train/actuator/test_networks.py -k about_one",
    ),
    Mutation(
        name="smoothness-free",
        file="train/tendon_train/policy/worlds/reward.py",
        old="config.smooth_weight * action_change.abs().sum(dim=-1)",
        new="0.0 * action_change.abs().sum(dim=-1)",
        tests="tests/train/policy/test_environment.py -k stated_sum",
    ),
    Mutation(
        name="turning-back-is-paid",
        file="train/tendon_train/policy/worlds/turning.py",
        old="self.rate.mul_(self._kept).add_((1.0 - self._kept) * rate)",
        new="self.rate.mul_(self._kept).sub_((1.0 - self._kept) * rate)",
        tests=f"{TURNING} paid",
    ),
    Mutation(
        name="pay-for-turning-is-a-price",
        file="train/tendon_train/policy/worlds/turning.py",
        old="((self.goal - self.rate).abs() - self.goal)",
        new="(self.goal - (self.goal - self.rate).abs())",
        tests=f"{TURNING} paid",
    ),
    Mutation(
        name="drop-free",
        file="train/tendon_train/policy/worlds/turning.py",
        old="price = price + own.drop_price * dropped",
        new="price = price + 0.0 * dropped",
        tests=f"{TURNING} drop",
    ),
    Mutation(
        name="balls-rub-alike",
        file="train/tendon_train/policy/worlds/turning.py",
        old="rubbing = 1.0 + spread * (2.0 * friction - 1.0)",
        new="rubbing = 1.0 + 0.0 * friction",
        tests=f"{TURNING} own_mass",
    ),
    Mutation(
        name="worn-bench-not-drawn",
        file="train/tendon_train/refresh/retraining.py",
        old="randomise=(*before.randomise, *worn)",
        new="randomise=before.randomise",
        tests="tests/train/refresh/test_retraining.py -k worn",
    ),
    Mutation(
        name="known-runs-are-news",
        file="tendon_newton/diagnosis/next_experiment/expected_run.py",
        old="informed(own.prior, self._worth * rows)",
        new="informed(own.prior, 0.0 * rows)",
        tests="tests/diagnosis/next_experiment/test_run_design.py -k half_a_bit",
    ),
    Mutation(
        name="only-the-likeliest-set-pulls",
        file="tendon_newton/diagnosis/next_experiment/worst_case.py",
        old="normals = [self._rng.normal(size=(each, len(own.numbers))) for own in sets]",
        new="normals = [self._rng.normal(size=(each * (k == 0), len(own.numbers)))\n"
        "                   for k, own in enumerate(sets)]",
        tests="tests/diagnosis/next_experiment/test_run_design.py -k unlikely",
    ),
    Mutation(
        name="interval-halved",
        file="tendon_newton/diagnosis/search/decide/fitted_sets.py",
        old="spreads = half / SURE",
        new="spreads = 0.5 * half / SURE",
        tests=f"{SETS} all_sets",
    ),
    Mutation(
        name="correlation-ignored",
        file="tendon_newton/diagnosis/posterior.py",
        old="eigh(self.covariance /",
        new="eigh(np.diag(np.diag(self.covariance)) /",
        tests="tests/diagnosis/search/test_posterior.py -k together",
    ),
    Mutation(
        name="suspected-causes-never-drawn",
        file="tendon_newton/diagnosis/posterior.py",
        old="chosen = rng.choice(len(weights), size=count, p=weights / weights.sum())",
        new="chosen = np.zeros(count, dtype=int)",
        tests="tests/diagnosis/search/test_posterior.py -k suspected",
    ),
    Mutation(
        name="one-draw-for-all-worlds",
        file="train/tendon_train/policy/worlds/drawn_sets.py",
        old="place = (DECK * share).long()",
        new="place = (DECK * share[:1].expand(len(share))).long()",
        tests="tests/train/policy/test_randomisation.py -k set_of_causes",
    ),
    Mutation(
        name="end-of-time-is-a-death",
        file="train/tendon_train/policy/worlds/environment.py",
        old='{"time_outs": time_outs.float(), "log": log}',
        new='{"time_outs": diverged.float(), "log": log}',
        tests="tests/train/policy/test_environment.py -k say_so",
    ),
    Mutation(
        name="actions-swapped-on-the-bench",
        file="tendon_newton/data/cards/policy_observation.py",
        old="latest = (position, velocity, self._action, self._previous)",
        new="latest = (position, velocity, self._previous, self._action)",
        tests="tests/hardware/goals/test_observation.py",
    ),
    # files, units, hardware
    Mutation(
        name="revolutions-in-half-turns",
        file="tendon_newton/data/formats/mapped_column.py",
        old="RPM = 2.0 * pi / 60.0",
        new="RPM = pi / 60.0",
        tests="tests/importers/test_import_mapped.py",
    ),
    Mutation(
        name="recording-in-both-splits",
        file="tendon_newton/data/dataset.py",
        old="        if count > 1:\n",
        new="        if count > 2:\n",
        tests="tests/bad_input/test_bad_input_files.py",
    ),
    Mutation(
        name="stamps-in-microseconds",
        file="tendon_newton/data/formats/message_streams.py",
        old="int(header.stamp.sec) * 1_000_000_000",
        new="int(header.stamp.sec) * 1_000_000",
        tests="tests/formats/test_mcap.py -k comes_back",
    ),
    Mutation(
        name="tension-rule-twice-as-high",
        file="hardware/tendon_hardware/safety_rules/rules.py",
        old="bounds=at_most(lambda limits: limits.force),",
        new="bounds=at_most(lambda limits: 2.0 * limits.force),",
        tests="tests/hardware/deploy/test_rules_on_a_bench.py",
    ),
    Mutation(
        name="current-that-brakes-is-free",
        file="hardware/tendon_hardware/safety_rules/rules.py",
        old="bounds=lambda limits: (-limits.current, limits.current),",
        new="bounds=at_most(lambda limits: limits.current),",
        tests="tests/hardware/deploy/test_rules_on_a_bench.py -k two_sides",
    ),
    Mutation(
        name="turn-lost-at-a-restart",
        file="hardware/tendon_hardware/servos/spool_angle.py",
        old="(latest - counts) // self._turn * self._turn",
        new="0",
        tests="tests/hardware/servos/test_specs.py",
    ),
    # what is silently wrong
    Mutation(
        name="export-of-the-packaged-finger",
        file="tendon_newton/diagnosis/diagnosed_bench.py",
        old="    return benches[0] if benches else default\n",
        new="    return default\n",
        tests="tests/diagnosis/test_diagnosed_bench.py -k export_is",
    ),
    Mutation(
        name="diagnosis-on-another-bench",
        file="tendon_newton/diagnosis/diagnosed_bench.py",
        old="if model_path(path) == path or not own:",
        new="if own:",
        tests="tests/diagnosis/test_diagnosed_bench.py -k another_bench",
    ),
    Mutation(
        name="spool-of-the-finger-for-all-benches",
        file="tendon_newton/data/importers/mapped.py",
        old='"spool_radius": spool_radius(mapping.bench)}',
        new='"spool_radius": 0.0125}',
        tests="tests/importers/test_gate.py -k spool",
    ),
    Mutation(
        name="start-at-rest-whatever-holds",
        file="tendon_newton/workflows/importing.py",
        old="    if abs(away) <= AT_REST:\n",
        new="    if abs(away) <= 10.0:\n",
        tests="tests/importers/test_gate.py -k first_rows",
    ),
    Mutation(
        name="names-from-logs-unchecked",
        file="tendon_newton/data/importers/imported.py",
        old="        check_name(self.recording.name, f",
        new="        print(self.recording.name, f",
        tests="tests/contracts/test_names.py -k so101",
    ),
    Mutation(
        name="link-followed-after-the-check",
        file="tendon_newton/data/files/text_file.py",
        old="if home is not None and os.path.commonpath(",
        new="if False and os.path.commonpath(",
        tests="tests/bad_input/test_foreign_files.py -k link_out",
    ),
    Mutation(
        name="load-cell-without-gravity",
        file="hardware/tendon_hardware/load_cells/calibration_fit.py",
        old="slope, tare, error = line_through(points, gravity)",
        new="slope, tare, error = line_through(points, 9.7)",
        tests="tests/hardware/load_cells/test_calibration.py",
    ),
)
"""By what they harm. A text that no longer stands in its file must be found its new place."""


def find_mutations(names: Sequence[str]) -> tuple[Mutation, ...]:
    """Return the entries of some names; all if none is given."""
    known = {mutation.name: mutation for mutation in MUTATIONS}
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise SystemExit(f"no mutation named {', '.join(unknown)}; --list shows all")
    return tuple(known[name] for name in names) or MUTATIONS


def run_tests(tree: Path, tests: str) -> tuple[int, str]:
    """Run a selection in a tree; return the exit code and the first test that failed."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *shlex.split(tests)],
        cwd=tree,
        env=os.environ | {"PYTHONPATH": search_path(tree)},
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return done.returncode, lines[0].split(" - ")[0] if lines else done.stdout[-300:].strip()


def check(tree: Path, mutation: Mutation) -> tuple[bool, str]:
    """Make one mistake in a tree, run its tests, and mend it; return whether they noticed."""
    file = tree / mutation.file
    whole = file.read_text(encoding="utf-8")
    if whole.count(mutation.old) != 1:
        return False, f"its text stands {whole.count(mutation.old)} times in {mutation.file}"
    file.write_text(whole.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        code, said = run_tests(tree, mutation.tests)
    finally:
        file.write_text(whole, encoding="utf-8")
    if code == NOT_NOTICED:
        return False, "no test noticed"
    return code == NOTICED, said


def main() -> int:
    """Make the chosen mistakes and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--list", action="store_true", help="show the entries and do nothing")
    arguments = parser.parse_args()
    chosen = find_mutations(arguments.names)
    if arguments.list:
        for mutation in chosen:
            print(f"{mutation.name:40s} {mutation.file:50s} {mutation.tests}")
        return 0
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(*NOT_COPIED))
        sound: dict[str, tuple[int, str]] = {}
        for mutation in chosen:
            begin = time.monotonic()
            if mutation.tests not in sound:
                sound[mutation.tests] = run_tests(tree, mutation.tests)
            code, said = sound[mutation.tests]
            if code == NOT_NOTICED:
                noticed, said = check(tree, mutation)
            else:
                noticed, said = False, f"its tests fail without it: {said}"
            missed += not noticed
            spent = time.monotonic() - begin
            word = "caught" if noticed else "MISSED"
            print(f"{word} {mutation.name:40s} {spent:4.0f} s  {said}", flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} caught")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
