"""Mistakes that some test must notice: each is made in a copy of the tree, and a failure expected.

Usage: ``.venv/bin/python -m tests.mutations [NAME ...] [--list]``. A copy of the working tree is
made. For each entry its tests must pass there, and fail once its mistake is made, alone. Entries
are mistakes that once passed unnoticed, and the like.
"""

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

from tests.interpreters import search_path

ROOT = Path(__file__).resolve().parents[1]
NOT_COPIED = (".git", ".venv", "build", "dist", "*.egg-info", ".*_cache", "__pycache__")
NOT_NOTICED, NOTICED = 0, 1
"""Exit codes of pytest: all passed, and some failed; others say that nothing was tested."""


@dataclass(frozen=True)
class Mutation:
    """One mistake and the tests that must notice it."""

    name: str
    file: str  # Where it is made, from the root of the tree
    old: str  # Text that stands there once
    new: str  # Text that takes its place
    tests: str  # Selection of pytest, as narrow as it can be


ARMS = "tests/arms/test_arms.py -k"
HELD_OUT = "tests/test_held_out.py -k"
PWM = "tests/physics/servos/test_pwm_servo.py"
FIRMWARE = "tests/physics/servos/test_firmware_effects.py -k"
PHYSICS = "tests/physics/test_effects_physics.py -k"
SETS = "tests/diagnosis/search/test_sets.py -k"
CHANGES = "tests/diagnosis/in_time/test_changes.py -k"
EVENTS = "tests/diagnosis/in_time/test_log_events.py -k"
NOT_NAMED = "tests/diagnosis/test_not_named.py -k"
CABLES = "lab/tests/test_cable_tool.py -k"
MAPPED = "tests/importers/test_import_mapped.py -k"
SMALL = "tests/diagnosis/in_time/test_small_changes.py -k"
SLOPES = "tests/physics/test_slopes.py -k"
VERDICTS = "tests/diagnosis/search/test_verdicts.py -k"
TURNING = "tests/train/policy/test_turning_parts.py -k"

MUTATIONS: tuple[Mutation, ...] = (
    # arms
    Mutation("base-tipped-the-other-way", "tendon_newton/arms/placement.py",
        ".as_matrix().T @ gravity", ".as_matrix() @ gravity", f"{ARMS} tipped"),
    Mutation("arm-without-a-load-has-a-best-sign", "tendon_newton/arms/placement.py",
        "if costs[s] <= most)", "if costs[s] < most)", f"{ARMS} stand_still"),
    Mutation("stated-lag-twice", "tendon_newton/arms/known_arm.py", " and e.cause not in stated",
        "", f"{ARMS} added_once"),
    Mutation("floor-without-force", "tendon_newton/arms/arm_simulation.py", "SHARE * below",
        "0.0 * below", f"{ARMS} together"),
    Mutation("floor-pushes-what-does-not-give-way", "tendon_newton/arms/arm_simulation.py",
        "felt = lifted > LEAST_LIFT", "felt = lifted >= 0.0", f"{ARMS} gives_way"),
    # held out
    Mutation("test-recordings-fitted", "tendon_newton/diagnosis/diagnose.py",
        "return Study(\n        dataset.train, model, tuple(EFFECTS)",
        "return Study(\n        (*dataset.train, *dataset.test), model, tuple(EFFECTS)",
        f"{HELD_OUT} diagnose"),
    Mutation("test-recordings-of-a-day-fitted", "tendon_newton/workflows/comparing_days.py",
        "first, day.train, unseen", "first, (*day.train, *day.test), unseen",
        f"{HELD_OUT} against"),
    Mutation("what-both-days-lack-has-moved", "tendon_newton/diagnosis/in_time/changes.py",
        "if lacking := alone.search():", "if lacking := frozenset[str]():", f"{CHANGES} lacks"),
    Mutation("moved-inside-its-interval", "tendon_newton/diagnosis/in_time/changes.py",
        "fewer = [moved - {n} for n in moved - self.mended if point.holds_before(n)]",
        "fewer = list[Moved]()", f"{CHANGES} answer"),
    Mutation("first-day-is-certain", "tendon_newton/diagnosis/in_time/changes.py",
        "return abs(high - low) / (2.0 * SURE)", "return 1.0e-6 * abs(high - low)",
        f"{CHANGES} answer"),
    Mutation("an-angle-skips-unseen", "tendon_newton/diagnosis/in_time/log_events.py",
        "if shares[at] <= LEAST_JUMP:", "if shares[at] <= 3.0 * LEAST_JUMP:", f"{EVENTS} skipped"),
    Mutation("usual-error-is-an-event", "tendon_newton/diagnosis/in_time/log_events.py",
        "if abs(out[peak]) <= PULSE_MARGIN * calm.pulse:",
        "if abs(out[peak]) <= 0.5 * calm.pulse:", f"{EVENTS} silent"),
    Mutation("step-is-no-event", "tendon_newton/diagnosis/in_time/log_events.py",
        "if step > LASTS * calm.step else", "if step > 500.0 * calm.step else",
        f"{EVENTS} slipped"),
    Mutation("a-beginning-is-calm", "tendon_newton/diagnosis/in_time/balance.py",
        "pace = np.full_like(command, np.ptp(command))", "pace = np.zeros_like(command)",
        f"{EVENTS} beginning"),
    Mutation("a-knock-is-no-force", "tendon_newton/diagnosis/in_time/log_events.py",
        "event.size * TRIED[::-1]))", "0.5 * event.size * TRIED[::-1]))", f"{EVENTS} knocked"),
    Mutation("any-file-is-a-recording", "tendon_newton/workflows/comparing_days.py",
        "own = tuple(r for r in (*day.train, *day.test) if r.name == path.name)",
        "own = day.train", "tests/diagnosis/in_time/test_comparing_days.py -k doctor"),
    Mutation("short-runs-tell-of-steps", "tendon_newton/diagnosis/in_time/log_events.py",
        "if own.time[-1] - own.time[0] > 2.0 * SIDE", "if own.time[-1] - own.time[0] > SIDE",
        f"{EVENTS} short"),
    Mutation("an-answer-about-all-is-about-none", "tendon_newton/diagnosis/in_time/changes.py",
        " or self.estimates.get(effect_of(owner), {})", " or {}", f"{CHANGES} all_servos"),
    Mutation("another-bench-is-a-day", "tendon_newton/workflows/comparing_days.py",
        "if own and other:", "if own and other and len(own) > 1:",
        "tests/doors/test_mistakes.py -k another"),
    Mutation("other-numbers-stand-still", "tendon_newton/diagnosis/in_time/changes.py",
        "moved, probability = name in point.moved,", "moved, probability = True,",
        f"{CHANGES} nothing_else"),
    Mutation("held-out-errors-on-train", "tendon_newton/diagnosis/diagnose.py",
        "test = Study(dataset.test, model,", "test = Study(dataset.train, model,",
        f"{HELD_OUT} diagnose"),
    Mutation("half-a-nat-is-nothing", "tendon_newton/diagnosis/search/refit.py",
        "LEAST_GAIN, LEAST_NATS = 1.0e-3, 0.3", "LEAST_GAIN, LEAST_NATS = 1.0e-3, 3.0e9",
        "tests/diagnosis/search/test_refit.py -k half_a_nat"),
    Mutation("valley-left-half-way", "tendon_newton/diagnosis/search/refit.py",
        "SHARES = (1.0, BOLDER, FREE)", "SHARES = (1.0, BOLDER, BOLDER)",
        "tests/diagnosis/search/test_refit.py -k valley"),
    Mutation("noise-hides-what-laws-share", "tendon_newton/diagnosis/search/search_worlds.py",
        "size = max(floors.of(signal), ", "size = max(noise.of(signal), ",
        f"{SETS} below_the_noise"),
    Mutation("step-of-the-search-decides", "tendon_newton/diagnosis/search/search_worlds.py",
        " / (1.0 + missed**2)", "", f"{SETS} long_step_misses"),
    Mutation("causes-begin-beside-what-is-stated", "tendon_newton/diagnosis/search/strategy.py",
        "ABSORBED = 2.0", "ABSORBED = 2.0e9", f"{SETS} gave_way"),
    Mutation("tolerances-have-an-error-of-form", "tendon_newton/identification/intervals.py",
        "np.diag(normal * ", "np.diag(wider * normal * ",
        "tests/identification/test_intervals.py -k stated"),
    Mutation("a-search-trusts-every-row", "tendon_newton/diagnosis/search/pool.py",
        "if not self.worlds.look_finer(values, floors) and floors", "if floors",
        f"{SETS} scores_sets_anew"),
    Mutation("supply-is-of-a-stated-size", "tendon_newton/identification/signals.py",
        "        relative=True,\n", "", "tests/identification/test_signals.py -k falls_with"),
    Mutation("rows-count-across-signals", "tendon_newton/diagnosis/search/refit.py",
        "counts[own] / counts[own].sum()", "counts[own]",
        "tests/diagnosis/search/test_refit.py -k slope_of_the"),
    Mutation("inner-folds-see-everything", "tendon_newton/diagnosis/search/refit.py",
        "if seen is None else seen", "if seen is None else seen | True",
        "tests/diagnosis/search/test_refit.py"),
    Mutation("a-limit-binds-where-a-special-case-has-none",
        "tendon_newton/diagnosis/search/starts.py", "**atom, **loose, **alike", "**atom, **alike",
        f"{SETS} slope_starts"),
    Mutation("a-limit-below-what-friction-takes", "tendon_newton/diagnosis/search/coordinates.py",
        "(1.3, 1.15, *SHARES_OF_PEAK)", "SHARES_OF_PEAK", f"{SETS} beyond_what_the_tendon_shows"),
    Mutation("a-knee-as-strong-as-its-limit", "tendon_newton/diagnosis/search/starts.py",
        "not shapes and not parameter.optional", "not shapes", f"{SETS} wherever_the_survey"),
    Mutation("all-rows-see-the-winner-alone", "tendon_newton/diagnosis/search/strategy.py",
        "fit, *nearly_worth(pool, fit, whole.price_share))", "fit)", f"{SETS} nearly_worth"),
    Mutation("all-rows-see-what-is-worth-nothing", "tendon_newton/diagnosis/search/strategy.py",
        "if pool.gain(other, fit) >= share * pool.bar(name):", "if True:",
        f"{SETS} nearly_worth"),
    Mutation("what-hardly-changes-is-a-cause", "tendon_newton/diagnosis/search/rule.py",
        "CHANGED = SEARCHED / 2.0", "CHANGED = SEARCHED / 4.0", f"{SETS} below_the_error"),
    Mutation("a-change-is-a-whole-error-of-form", "tendon_newton/diagnosis/search/rule.py",
        "CHANGED = SEARCHED / 2.0", "CHANGED = SEARCHED", f"{SETS} below_the_error"),
    Mutation("all-rows-see-any-that-is-near", "tendon_newton/diagnosis/search/strategy.py",
        "sorted(near, key=pool.cost)[:RIVALS]", "near[:RIVALS]", f"{SETS} the_best_of_what"),
    Mutation("no-set-with-other-forces", "tendon_newton/diagnosis/search/prune.py",
        "similar_starts(pool, fit, names)", "[]", f"{SETS} moves_and_reads"),
    Mutation("no-answer-with-other-forces", "tendon_newton/diagnosis/search/decide/told.py",
        "(decided.fit, *found)", "(decided.fit,)", f"{SETS} moves_and_reads"),
    Mutation("a-set-with-other-forces-keeps-all", "tendon_newton/diagnosis/search/prune.py",
        "            prune(pool, similar)", "            pass", f"{SETS} moves_and_reads"),
    Mutation("a-refused-scale-comes-back", "tendon_newton/diagnosis/search/decide/told.py",
        "similar_starts(decisive, decided.fit, allowed)",
        "similar_starts(decisive, decided.fit, names)", f"{SETS} moves_and_reads"),
    Mutation("a-current-does-not-grow-with-forces", "tendon_newton/effects/current_sensor_gain.py",
        'of="1/N", ', "", "tests/physics/test_similar_forces.py -k sensor"),
    Mutation("every-scale-grows-at-once", "tendon_newton/diagnosis/search/starts.py",
        "if numbers[moved[n]].time_power <= most", "if True", f"{SETS} moves_and_reads"),
    Mutation("no-set-with-another-spool", "tendon_newton/diagnosis/search/starts.py",
        "SIMILAR if spools else", "SIMILAR[:1] if spools else", f"{SETS} larger_spool"),
    Mutation("what-is-nearly-right-goes-always", "tendon_newton/diagnosis/search/starts.py",
        "dict.fromkeys([causes, same])", "[causes]", f"{SETS} larger_spool"),
    Mutation("an-obstacle-stays-where-travels-grow", "tendon_newton/effects/obstruction.py",
        'of="m", ', "", "tests/physics/test_similar_forces.py -k obstruction"),
    Mutation("what-is-nearly-right-stays", "tendon_newton/diagnosis/search/starts.py",
        "CLOSE = 0.5", "CLOSE = 0.0", f"{SETS} moves_and_reads"),
    Mutation("an-overload-stays-where-forces-grow", "tendon_newton/effects/overload_cut.py",
        'Parameter("duty", "1", of="N", ', 'Parameter("duty", "1", ',
        "tests/physics/test_similar_forces.py -k overload"),
    Mutation("a-reading-grows-with-forces", "tendon_newton/effects/load_cell_bias.py",
        'of="1", ', "", "tests/physics/test_similar_forces.py"),
    Mutation("a-limit-beyond-its-range", "tendon_newton/diagnosis/search/coordinates.py",
        "parameter.nominal / high", "0.0", f"{SETS} beyond_its_range"),
    Mutation("a-limit-at-its-end-is-a-number", "tendon_newton/diagnosis/posterior.py",
        'u <= self.lower if self.kind == "inverse" else u == 0.0', "u == 0.0",
        f"{SETS} beyond_its_range"),
    Mutation("something-in-the-way-is-a-gear", "tendon_newton/diagnosis/accounts/wrong_scales.py",
        "min(angles, key=lambda ratio: abs(np.log(abs(ratio))))", "float(np.median(angles))",
        "tests/diagnosis/reporting/test_next_steps.py -k in_the_way"),
    Mutation("import-starts-from-test-logs", "tendon_newton/data/importers/writing.py",
        "imported.start_model(split.train)", "imported.model", f"{HELD_OUT} import"),
    Mutation("validation-recordings-fitted", "train/tendon_train/actuator/samples/folds.py",
        "fit=tuple(r for r in recordings if r.name not in held)", "fit=tuple(recordings)",
        "tests/train/actuator/test_windows.py -k validation"),
    Mutation("cut-log-shares-rows", "tendon_newton/identification/cutting.py",
        "rows_of(recording, slice(row, recording.sample_count)",
        "rows_of(recording, slice(row - 40, recording.sample_count)",
        "tests/identification/test_noise_floor.py"),
    # what is certain
    Mutation("intervals-four-times-too-wide", "tendon_newton/identification/intervals.py",
        "WIDENING = 4.0", "WIDENING = 12.0", "tests/identification/test_intervals.py"),
    Mutation("intervals-half-as-wide", "tendon_newton/identification/intervals.py",
        "WIDENING = 4.0", "WIDENING = 1.0", "tests/identification/test_intervals.py"),
    Mutation("other-sets-widen-nothing", "tendon_newton/diagnosis/search/decide/fitted_sets.py",
        "whole = np.hypot(half, [", "whole = np.hypot(half, 0.0) + 0.0 * np.array([",
        f"{SETS} by_their_weight"),
    Mutation("what-is-unnamed-is-not-there", "tendon_newton/diagnosis/search/decide/find_causes.py",
        "told = with_unnamed(decisive, final, shown, names, rivals, worths)", "told = shown",
        "tests/diagnosis/search/test_verdicts.py -k unnamed"),
    Mutation("what-is-unnamed-is-twice-as-large",
        "tendon_newton/diagnosis/search/decide/unnamed.py",
        "UNNAMED = 2.0", "UNNAMED = 8.0", f"{SETS} too_small_to_be_named"),
    Mutation("a-named-cause-may-be-nothing", "tendon_newton/diagnosis/search/decide/unnamed.py",
        "if number.owner in worths and", "if False and", f"{SETS} too_small_to_be_named"),
    Mutation("a-rival-is-there-beside-what-it-replaces",
        "tendon_newton/diagnosis/search/decide/unnamed.py",
        "name not in classes.get(owner, ())", "True", f"{SETS} too_small_to_be_named"),
    Mutation("sets-say-as-much-as-another", "tendon_newton/diagnosis/search/decide/fitted_sets.py",
        "weights @ off**2 / total", "np.mean(off**2)", f"{SETS} by_their_weight"),
    Mutation("a-form-left-open-excludes-its-special-case",
        "tendon_newton/diagnosis/search/decide/decision.py",
        "found.intervals[column][0] <= form.lower", "found.intervals[column][0] < form.lower",
        f"{SETS} leaves_both"),
    Mutation("price-per-cause", "tendon_newton/diagnosis/search/pool.py",
        "return self.price * len(law_of(name).parameters)", "return self.price",
        f"{SETS} its_price"),
    Mutation("a-bench-ends-at-its-tolerance", "tendon_newton/simulation/model/bench_numbers.py",
        "ANOTHER = 1.25", "ANOTHER = 1.05",
        "tests/identification/test_bench_numbers.py -k differ_a_little"),
    Mutation("refused-causes-have-weight", "tendon_newton/diagnosis/search/decide/fitted_sets.py",
        "if not key & set(refused)", "if True", f"{SETS} as_probable"),
    Mutation("named-though-unseen-parts-refuse-it",
        "tendon_newton/diagnosis/search/decide/decision.py",
        "if not ended and worths[worst] >= 1.0:", "if not ended:", f"{VERDICTS} beside_one"),
    Mutation("nothing-named-is-no-gap", "tendon_newton/diagnosis/search/decide/find_causes.py",
        'return "no_gap" if leaves_nothing_at_any_step(decisive, final) else "unexplained"',
        'return "no_gap"', f"{VERDICTS} neither_named"),
    Mutation("a-fifth-of-a-gap-suffices", "tendon_newton/diagnosis/search/rule.py",
        "LEAST_EXPLAINED = 0.8", "LEAST_EXPLAINED = 0.2", f"{VERDICTS} most_of_a_gap"),
    Mutation("ten-prices-are-nothing", "tendon_newton/diagnosis/search/pool.py",
        "if self.excess(judged) >= self.dearest:", "if self.excess(judged) >= 10.0 * self.dearest:",
        f"{VERDICTS} little_is_left"),
    Mutation("a-verdict-is-as-strict-as-a-search", "tendon_newton/diagnosis/search/pool.py",
        "1.0 if usual else SEARCHED) < 1.0", "SEARCHED) < 1.0", f"{SETS} usually_miss"),
    Mutation("form-hides-what-noise-tells", "tendon_newton/diagnosis/search/decide/decision.py",
        "floors = sharp(pool)", "floors = pool.floors", f"{VERDICTS} no_class"),
    Mutation("blocks-tell-sets-apart-in-full",
        "tendon_newton/diagnosis/search/decide/fitted_sets.py", " / SHARED_FORM**2", "",
        f"{SETS} blocks_share"),
    Mutation("named-at-the-edge-of-its-range", "tendon_newton/diagnosis/search/decide/decision.py",
        "ended = [n for n in final.names if at_bound(decisive, final, n)]",
        "ended: list[str] = []", f"{NOT_NAMED} edge"),
    Mutation("named-though-left-open", "tendon_newton/diagnosis/search/decide/fitted_sets.py",
        "else low <= p.null <= high", "else False", f"{SETS} holds_none"),
    Mutation("stated-numbers-are-free", "tendon_newton/diagnosis/search/search_worlds.py",
        "return stated - WITHIN * spread, stated + WITHIN * spread",
        "return stated - 99.0 * spread, stated + 99.0 * spread", f"{SETS} beyond_its_tolerance"),
    Mutation("a-stated-number-hides-a-fault",
        "tendon_newton/diagnosis/search/decide/told.py",
        "if name in names and z > WITHIN - EDGE}", "if name in names and z > 99.0}",
        f"{SETS} end_of_its_tolerances"),
    Mutation("a-stated-number-that-is-off-goes-unsaid", "tendon_newton/diagnosis/diagnose.py",
        "(*benches, *undoubted_columns(study, found.effects))", "benches",
        "tests/diagnosis/test_evaluation.py -k to_be_measured"),
    Mutation("a-number-nothing-is-known-of-is-told",
        "tendon_newton/diagnosis/search/decide/told.py", "if not is_within(decisive, shown, n)", "",
        f"{SETS} end_of_its_tolerances"),
    Mutation("causes-that-share-are-not-asked", "tendon_newton/diagnosis/search/decide/told.py",
        "and left_open == 1", "and left_open < 99", f"{SETS} stands_for_causes"),
    Mutation("what-is-sure-is-lost", "tendon_newton/diagnosis/search/decide/told.py",
        "and sure < set(f.names)", "and f.names", f"{SETS} stands_for_causes"),
    Mutation("parts-tell-of-what-they-do-not-show",
        "tendon_newton/diagnosis/search/unseen_parts.py", "shares < TOLD", "shares < 0.0",
        f"{SETS} left_out"),
    Mutation("little-is-enough-beside-what-is-left",
        "tendon_newton/diagnosis/search/decide/account.py", "else SURE * decisive.price",
        "else 0.0", f"{SETS} three_prices"),
    Mutation("hardly-a-gap-decides", "tendon_newton/identification/noise_floor.py",
        "HARDLY_ANY = 0.02", "HARDLY_ANY = 0.0", "tests/diagnosis/test_evaluation.py"),
    Mutation("a-small-gap-may-not-double", "tendon_newton/identification/noise_floor.py",
        "size if gone > 0.0 else largest", "size", "tests/diagnosis/test_evaluation.py"),
    Mutation("a-mend-promises-nothing", "tendon_newton/diagnosis/in_time/changes.py",
        "PROMISED = 1.4", "PROMISED = 0.0", "tests/diagnosis/in_time/test_changes.py -k promises"),
    Mutation("a-servo-without-a-cause-is-written", "tendon_newton/arms/known_arm.py",
        "return found.model if found.effects else self.plain[joint]", "return found.model",
        "tests/arms/test_arms.py -k nothing_is_named"),
    Mutation("bristles-have-another-slope", "tendon_newton/effects/hysteresis.py",
        "Jet(share, share / base,", "Jet(share, share,",
        "tests/physics/servos/test_firmware_effects.py -k slope_of_hysteresis"),
    Mutation("angles-alone-settle-a-cause", "tendon_newton/diagnosis/search/decide/decision.py",
        "return not (has_force and ", "return not (", f"{SETS} plain_models_are_asked"),
    Mutation("rows-alone-settle-a-cause", "tendon_newton/diagnosis/search/decide/decision.py",
        "leaves_nothing(fit, anywhere=True, usual=True))", "leaves_nothing(fit, usual=True))",
        f"{SETS} plain_models_are_asked"),
    Mutation("only-what-is-named-is-written", "tendon_newton/diagnosis/search/decide/decision.py",
        "found.sum() + cost(fit) < predicts", "found.sum() + cost(fit) > predicts",
        "tests/diagnosis/search/test_sets.py -k predict"),
    Mutation("what-predicts-best-is-dropped", "tendon_newton/diagnosis/findings.py",
        "return self.predictor or self.final", "return self.final",
        "tests/diagnosis/search/test_sets.py -k written"),
    Mutation("another-bench-has-only-aged", "tendon_newton/diagnosis/in_time/changes_report.py",
        "STRANGE = 3.0", "STRANGE = 300.0", "tests/diagnosis/in_time/test_changes.py -k doubted"),
    Mutation("a-bus-without-noise", "hardware/tendon_hardware/virtual_bench/served_bench.py",
        "rng.random() < faults.line_noise", "rng.random() < 0.0",
        "tests/hardware/virtual_bench/test_faults.py -k noise_comes"),
    Mutation("slow-cells-may-not-jump", "hardware/tendon_hardware/load_cells/cell_doubt.py",
        "FAST = 60.0", "FAST = 1.0", "tests/hardware/load_cells/test_cell_doubt.py -k jump"),
    Mutation("letting-out-a-little-excuses-a-dead-cell",
        "hardware/tendon_hardware/load_cells/cell_doubt.py", "LET_OUT = 2.0", "LET_OUT = 2000.0",
        "tests/hardware/load_cells/test_cell_doubt.py -k lets_out"),
    Mutation("what-ended-at-an-edge-is-written",
        "tendon_newton/diagnosis/search/decide/decision.py", " and not beyond & set(f.names)", "",
        "tests/diagnosis/search/test_sets.py -k predict"),
    Mutation("a-register-is-a-cause", "tendon_newton/identification/testable.py",
        "if name in study.exact:", "if not name:",
        "tests/diagnosis/search/test_sets.py -k exactly"),
    Mutation("sliding-sticks-more", "tendon_newton/effects/stribeck_friction.py",
        "if values[1] > values[0]:", "if values[1] != values[0]:",
        "tests/physics/test_effects_physics.py -k stribeck"),
    Mutation("recordings-that-differ-are-blocks-of-time",
        "tendon_newton/identification/intervals.py",
        "by_recording = half_width(point, where.recording, spread, together)",
        "by_recording = by_block", "tests/identification/test_intervals.py -k three_recordings"),
    Mutation("few-recordings-have-a-normal-quantile", "tendon_newton/identification/intervals.py",
        "stdtrit((count - 1, np.inf)", "stdtrit((1e6, np.inf)",
        "tests/identification/test_intervals.py -k student"),
    Mutation("large-class-is-an-answer", "lab/tendon_lab/exam/exam_score.py",
        "c if len(c) <= LARGEST_CLASS else c[:1]", "c", "lab/tests/exam/test_exam_report.py"),
    Mutation("run-whose-worst-case-was-not-looked-at",
        "tendon_newton/diagnosis/next_experiment/worst_case.py", "            kept += good\n",
        "            kept += own[begin:]\n",
        "tests/diagnosis/next_experiment/test_run_design.py -k looked_at"),
    Mutation("run-of-a-further-attempt-counts-as-missing",
        "hardware/tendon_hardware/collection/collect_plan.py",
        '{AGAIN.sub("", Path(file).stem)', "{Path(file).stem",
        "tests/hardware/test_collect.py -k further_attempt"),
    Mutation("deleted-recording-counts-as-there",
        "hardware/tendon_hardware/collection/collect_plan.py",
        " if (out / file).exists()}", "}", "tests/hardware/test_collect.py -k deleted"),
    Mutation("folder-of-two-servos", "hardware/tendon_hardware/collection/collect_plan.py",
        '        "servo": address.servo,\n', "", "tests/hardware/test_collect.py -k one_servo"),
    Mutation("force-network-of-two-servos", "train/tendon_train/actuator/samples/folds.py",
        "servo_kinds(recordings)) > 1", "servo_kinds(recordings)) > 2",
        "tests/train/actuator/test_training.py -k one_servo"),
    Mutation("force-network-guards-another-servo",
        "hardware/tendon_hardware/safety_rules/force_estimate.py",
        "estimate.card.servo or servo)", "servo)",
        "tests/hardware/deploy/test_force_estimate.py -k another_servo"),
    Mutation("run-of-other-numbers-is-of-the-files", "tendon_newton/exports/export_page.py",
        "runs if has_numbers(run)", "runs[:0]",
        "tests/exports/test_every_export.py -k numbers_of_its_own"),
    Mutation("stuck-cell-without-a-calibration",
        "hardware/tendon_hardware/safety_rules/force_watch.py",
        "if self.calibration is None and self._doubt.fault", "if False and self._doubt.fault",
        "tests/hardware/test_collect.py -k stuck_cell"),
    Mutation("step-of-a-command-is-a-seam", "tendon_newton/data/checks/seam_checks.py",
        "if own is None or recording.command", "if recording.command",
        "tests/formats/test_lint.py -k steps_by_a_turn"),
    Mutation("another-spool-than-the-assets-untold", "tendon_newton/diagnosis/diagnosed_bench.py",
        "    if others:\n", "    if others and False:\n",
        "tests/diagnosis/test_diagnosed_bench.py -k another_spool"),
    Mutation("any-finger-has-our-spool", "tendon_newton/workflows/collection.py",
        "return spool_radius(options.bench)", "return radius",
        "tests/mechanisms/test_your_own_finger.py -k spool_of_its_asset"),
    Mutation("gap-at-the-end-lasts-no-time", "hardware/tendon_hardware/collection/run_loop.py",
        "            self.gaps.end()\n", "            pass\n",
        "tests/hardware/test_faults.py -k stays_away"),
    Mutation("killed-log-untold", "tendon_newton/workflows/deployment.py",
        "and breaks_off(log)", "and not breaks_off(log)",
        "tests/hardware/deploy/test_deploy.py -k killed_deployment"),
    # physics, sensors, gradients
    Mutation("delay-in-whole-rows", "tendon_newton/effects/command_delay.py",
        "return time - values[0]",
        "return time - real(int(values[0] * real(80.0) + real(0.5))) / real(80.0)",
        f"{PHYSICS} delay"),
    Mutation("a-slack-string-pushes-a-little", "tendon_newton/law/string.py",
        "target < real(0.0):", "target < real(-1.0e9):", f"{PHYSICS} turns_back"),
    Mutation("a-sliding-spool-begins-stuck", "tendon_newton/law/string.py",
        "AHEAD = 1.0e-5", "AHEAD = 0.0", f"{PHYSICS} no_shorter_steps"),
    Mutation("a-spool-never-sticks", "tendon_newton/law/string.py",
        "if least[0] == most[0]:", "if least[0] <= real(1.0e9):", f"{PHYSICS} light_one"),
    Mutation("bristles-bend-with-the-mechanism", "tendon_newton/law/string.py",
        "out.velocity = turned / tendon.elapsed", "out.velocity = tendon.velocity",
        f"{PHYSICS} light_one"),
    Mutation("back-emf-five-per-cent", "tendon_newton/actuators/pwm_servo.py",
        "tendon.angle_rate * p[3])", "tendon.angle_rate * p[3] * real(1.05))", PWM),
    Mutation("rotor-twice", "tendon_newton/actuators/pwm_servo.py", "return p[5]",
        "return real(2.0) * p[5]", PWM),
    Mutation("gear-on-the-motors-side", "tendon_newton/law/gear.py", "probe = tendon.carried",
        "probe = motor[0]", f"{FIRMWARE} falling"),
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
    Mutation("overload-never-ends", "tendon_newton/effects/overload_cut.py",
        "turned = duty[0] * lasted < real(0.0)", "turned = duty[0] * lasted < real(-1.0e9)",
        f"{FIRMWARE} other_side"),
    Mutation("overload-cut-at-the-next-step", "tendon_newton/effects/overload_cut.py",
        "    counts_to = 2\n", "", f"{FIRMWARE} inside_a_step"),
    Mutation("profile-brakes-too-late", "tendon_newton/effects/acceleration_limit.py",
        "top = wp.min(wp.sqrt(reach), values[1])",
        "top = wp.min(wp.sqrt(real(2.0) * reach), values[1])", f"{FIRMWARE} trapezoid"),
    Mutation("delayed-command-in-the-mean", "tendon_newton/simulation/kernels/acting_command.py",
        "        if later > real(INSTANT) and", "        if later > interval and",
        f"{PHYSICS} divides_a_substep"),
    Mutation("heat-linear-in-force", "tendon_newton/effects/torque_fade.py",
        "settled = values[0] * force * force", "settled = values[0] * wp.abs(force)",
        f"{PHYSICS} fades"),
    Mutation("offset-the-other-way", "tendon_newton/effects/position_offset.py",
        "return angle + Jet(values[0]", "return angle - Jet(values[0]",
        "tests/physics/test_sensor_effects_physics.py -k offset"),
    Mutation("contact-that-does-not-damp-along", "tendon_newton/simulation/contact/contacts.py",
        "c_t = real(SHEAR) * chi * elastic", "c_t = real(0.0) * chi * elastic",
        "tests/physics/contact/test_free_bodies.py -k rocks"),
    Mutation("gradient-one-per-cent-short", "tendon_newton/gradients/trajectory_gradient.py",
        "plain_tensor(input_array(rollout, name).grad)",
        "(0.99 * plain_tensor(input_array(rollout, name).grad))",
        "tests/physics/gradients/test_learned_gradients.py -k torch_reaches"),
    Mutation("sensor-noise-too-small", "tendon_newton/data/checks/measures.py",
        "/ np.sqrt(6.0))", "/ np.sqrt(12.0))", "tests/identification/test_noise_floor.py"),
    # networks and policies
    Mutation("network-input-unscaled", "tendon_newton/force_networks/force_network.py",
        "- self.input_mean) / self.input_scale", "- self.input_mean)",
        "tests/train/actuator/test_artifact.py -k 'normalisation or about_one'"),
    Mutation("network-scale-not-taken", "tendon_newton/force_networks/force_network.py",
        "self.input_scale.copy_(inputs.std(dim=0).clamp_min(1.0e-6))",
        "self.input_scale.fill_(1.0)", "tests/train/actuator/test_artifact.py -k about_one"),
    Mutation("smoothness-free", "train/tendon_train/policy/worlds/environment.py",
        "self.config.smooth_weight * change.abs().sum(dim=-1)",
        "0.0 * change.abs().sum(dim=-1)",
        "tests/train/policy/test_environment.py -k that_was_seen"),
    Mutation("turning-back-is-paid", "train/tendon_train/policy/worlds/turning.py",
        "self.rate.mul_(self._kept).add_((1.0 - self._kept) * rate)",
        "self.rate.mul_(self._kept).sub_((1.0 - self._kept) * rate)", f"{TURNING} paid"),
    Mutation("pay-for-turning-is-a-price", "train/tendon_train/policy/worlds/turning.py",
        "((wanted - self.rate).abs() - self.goal)",
        "(self.goal - (wanted - self.rate).abs())", f"{TURNING} paid"),
    Mutation("caught-up-in-a-second", "train/tendon_train/policy/worlds/turning.py",
        "self._behind / own.catch_up_time", "self._behind", f"{TURNING} paid"),
    Mutation("drop-free", "train/tendon_train/policy/worlds/turning.py",
        "price = price + own.drop_price * dropped", "price = price + 0.0 * dropped",
        f"{TURNING} drop"),
    Mutation("balls-rub-alike", "train/tendon_train/policy/worlds/turning.py",
        "rubbing = 1.0 + spread * (2.0 * friction - 1.0)", "rubbing = 1.0 + 0.0 * friction",
        f"{TURNING} own_mass"),
    Mutation("only-the-likeliest-set-pulls",
        "tendon_newton/diagnosis/next_experiment/worst_case.py",
        "normals = [self._rng.normal(size=(each, len(own.numbers))) for own in sets]",
        "normals = [self._rng.normal(size=(each * (k == 0), len(own.numbers)))\n"
        "                   for k, own in enumerate(sets)]",
        "tests/diagnosis/next_experiment/test_run_design.py -k unlikely"),
    Mutation("interval-halved", "tendon_newton/diagnosis/search/decide/fitted_sets.py",
        "spreads = half / SURE", "spreads = 0.5 * half / SURE", f"{SETS} all_sets"),
    Mutation("correlation-ignored", "tendon_newton/diagnosis/posterior.py",
        "eigh(self.covariance /", "eigh(np.diag(np.diag(self.covariance)) /",
        "tests/diagnosis/search/test_posterior.py -k together"),
    Mutation("end-of-time-is-a-death", "train/tendon_train/policy/worlds/environment.py",
        '{"time_outs": time_outs.float(), "log": log}',
        '{"time_outs": diverged.float(), "log": log}',
        "tests/train/policy/test_environment.py -k say_so"),
    Mutation("actions-swapped-on-the-bench", "tendon_newton/data/cards/policy_observation.py",
        "latest = (position, velocity, self._action, self._previous)",
        "latest = (position, velocity, self._previous, self._action)",
        "tests/hardware/goals/test_observation.py"),
    # files, units, hardware
    Mutation("revolutions-in-half-turns", "tendon_newton/data/formats/mapped_column.py",
        "RPM = 2.0 * pi / 60.0", "RPM = pi / 60.0", "tests/importers/test_import_mapped.py"),
    Mutation("recording-in-both-splits", "tendon_newton/data/dataset.py",
        "        if count > 1:\n", "        if count > 2:\n",
        "tests/bad_input/test_bad_input_files.py"),
    Mutation("stamps-in-microseconds", "tendon_newton/data/formats/message_streams.py",
        "int(header.stamp.sec) * 1_000_000_000", "int(header.stamp.sec) * 1_000_000",
        "tests/formats/test_mcap.py -k comes_back"),
    Mutation("tension-rule-twice-as-high", "hardware/tendon_hardware/safety_rules/rules.py",
        "bounds=at_most(lambda limits: limits.bench.force), reach=lambda reach: reach.force,",
        "bounds=at_most(lambda limits: 2 * limits.bench.force), reach=lambda reach: reach.force,",
        "tests/hardware/deploy/test_rules_on_a_bench.py"),
    Mutation("current-that-brakes-is-free", "hardware/tendon_hardware/safety_rules/rules.py",
        "bounds=lambda limits: (-limits.current, limits.current),",
        "bounds=at_most(lambda limits: limits.current),",
        "tests/hardware/deploy/test_rules_on_a_bench.py -k two_sides"),
    Mutation("turn-lost-at-a-restart", "hardware/tendon_hardware/servos/spool_angle.py",
        "(latest - counts) // self._turn * self._turn", "0", "tests/hardware/servos/test_specs.py"),
    # changes between days
    Mutation("small-changes-beside-a-large-one-are-free",
        "tendon_newton/diagnosis/in_time/changes.py", "MINOR = 0.05", "MINOR = 0.0",
        f"{SMALL} not_free"),
    Mutation("what-imitates-a-change-is-not-told", "tendon_newton/diagnosis/in_time/changes.py",
        "rivals = self.rivals(name, point.moved) if moved else ()", "rivals = ()",
        f"{SMALL} imitates"),
    # units, slopes, strings
    Mutation("pounds-are-kilograms", "tendon_newton/data/formats/mapped_column.py",
        '"lbf": 4.4482216', '"lbf": 9.80665', f"{MAPPED} as_it_is_defined"),
    Mutation("thousandths-of-a-speed-are-whole", "tendon_newton/data/formats/mapped_column.py",
        '"mrad/s": 1.0e-3', '"mrad/s": 1.0', f"{MAPPED} as_it_is_defined"),
    Mutation("urdf-does-not-turn-what-weighs", "tendon_newton/exports/arms/urdf_arm.py",
        "centre = turn.T @ (", "centre = (", "tests/arms/test_urdf.py -k turned"),
    Mutation("a-string-pushes-a-little", "tendon_newton/law/string.py",
        "if flow.tension[0] < tendon.least_tension:",
        "if flow.tension[0] < tendon.least_tension - real(0.2):",
        "tests/physics/test_closed_form.py -k does_not_push"),
    Mutation("a-limit-keeps-its-slope", "tendon_newton/law/servo.py",
        "out = Jet(upper, real(0.0), real(0.0))", "out = Jet(upper, signal[1], signal[2])",
        f"{SLOPES} limit"),
    Mutation("a-damper-has-no-slope", "tendon_newton/law/joint.py",
        "real(0.0), -joint.damping)", "real(0.0), real(0.0))", f"{SLOPES} dampers"),
    Mutation("a-gear-has-half-a-slope", "tendon_newton/law/gear.py",
        "gear[1] * motor[2] + gear[2])", "gear[1] * motor[2])", f"{SLOPES} gear"),
    Mutation("a-body-turns-as-a-ball-does", "tendon_newton/simulation/contact/free_body.py",
        "bias = -wp.cross(spin, inertia * spin)", "bias = real(0.0) * spin",
        "tests/physics/contact/test_free_bodies.py -k tumbles"),
    # bench and rivals
    Mutation("a-cell-upside-down-pulls-without-end",
        "hardware/tendon_hardware/safety_rules/rules.py",
        "value=lambda g: None if g.force is None else abs(g.force),", "value=lambda g: g.force,",
        "tests/hardware/deploy/test_rules_on_a_bench.py -k two_sides"),
    Mutation("a-network-sees-what-comes", "lab/studies/cable_tool/rivals.py",
        "recording.time[:, None] - PAST", "recording.time[:, None] + PAST", f"{CABLES} future"),
    Mutation("a-law-is-fitted-to-what-is-tested", "lab/studies/cable_tool/rivals.py",
        "study = Study([run.recording for run in train]",
        "study = Study([run.recording for run in test]", f"{CABLES} law_is_fitted"),
    # what is silently wrong
    Mutation("export-of-the-packaged-finger", "tendon_newton/diagnosis/diagnosed_bench.py",
        "    return benches[0] if benches else default\n", "    return default\n",
        "tests/diagnosis/test_diagnosed_bench.py -k export_is"),
    Mutation("diagnosis-on-another-bench", "tendon_newton/diagnosis/diagnosed_bench.py",
        "if model_path(path) == path or not own:", "if own:",
        "tests/diagnosis/test_diagnosed_bench.py -k another_bench"),
    Mutation("training-goes-on-with-another-finger",
        "train/tendon_train/policy/runs/policy_training.py",
        "layers_of(environment.mechanism.asset)",
        "{environment.mechanism.asset.name: environment.mechanism.asset}",
        "tests/train/policy/test_verb.py -k began_with"),
    Mutation("policy-behind-another-loop",
        "hardware/tendon_hardware/deployment/deploy_settings.py",
        "            **law,\n", "", "tests/hardware/deploy/test_policy_files.py -k its_training"),
    Mutation("policy-of-a-known-servo-for-the-assets",
        "train/tendon_train/policy/runs/policy_export.py",
        "servo=named or ", "servo=", "tests/train/policy/test_verb.py -k known_servo"),
    Mutation("torque-of-a-shaft-pulls-a-string", "tendon_newton/diagnosis/known_servos.py",
        "BenchScale(force=1.0 / ratio,", "BenchScale(force=1.0,",
        "tests/contracts/test_known_servos.py -k alike"),
    Mutation("spool-of-the-finger-for-all-benches", "tendon_newton/data/importers/mapped.py",
        '"spool_radius": spool_radius(mapping.bench)}', '"spool_radius": 0.0125}',
        "tests/importers/test_gate.py -k spool"),
    Mutation("start-at-rest-whatever-holds", "tendon_newton/workflows/importing.py",
        ' start="equilibrium")) is not None:', ' start="first_row")) is not None:',
        "tests/importers/test_gate.py -k brief_rest"),
    Mutation("a-run-begins-without-its-friction", "tendon_newton/data/checks/first_rows.py",
        "if angle.shape[1] > 1 or", "if angle.shape[1] > 0 or",
        "tests/physics/test_log_starts.py -k friction_holds"),
    Mutation("a-program-starts-without-friction", "tendon_newton/exports/written_program.py",
        "(sticks or not begin.if_held)", "not begin.if_held",
        "tests/exports/test_mujoco.py -k starts_where"),
    Mutation("a-program-holds-what-nothing-holds", "tendon_newton/exports/written_program.py",
        " and (sticks or not begin.if_held)", "",
        "tests/exports/test_mujoco.py -k starts_where"),
    Mutation("a-held-start-moves-with-the-gain", "tendon_newton/gradients/gradient_kernels.py",
        "starts_as_measured(commands, i, row)", "commands.start[i] == 1",
        "tests/physics/gradients/test_gradients.py -k friction_holds"),
    Mutation("what-nothing-holds-begins-elsewhere", "tendon_newton/simulation/dynamics/settling.py",
        " and drive.dry != real(0.0))", ")",
        "tests/physics/test_log_starts.py -k friction_holds"),
    Mutation("guides-have-no-bristles", "tendon_newton/law/bristles.py",
        "left = transmission_effects(force, bent, p)",
        "left = transmission_effects(force, tendon, p)",
        "tests/physics/servos/test_presliding.py -k guides"),
    Mutation("bristles-begin-straight", "tendon_newton/simulation/dynamics/settling.py",
        "wanted = hold + missed", "wanted = hold",
        "tests/physics/servos/test_presliding.py -k guides"),
    Mutation("bristles-bend-as-in-equilibrium", "tendon_newton/simulation/dynamics/settling.py",
        "bent_memory(mechanism, p, drive, as_measured, target, x)",
        "bent_memory(mechanism, p, drive, False, target, x)",
        "tests/physics/servos/test_presliding.py -k log_begins"),
    Mutation("a-program-begins-with-straight-bristles", "tendon_newton/exports/runtime/resting.py",
        'if not servo.numbers["bristles"]:', "if servo.dry == servo.dry:",
        "tests/exports/test_mujoco.py -k starts_where"),
    Mutation("hysteresis-holds-a-start", "tendon_newton/effects/hysteresis.py",
        "values[0] > real(0.0) and tendon.elapsed < real(RELAXED)", "values[0] > real(0.0)",
        "tests/physics/servos/test_presliding.py -k dahls"),
    Mutation("rows-after-gaps-are-drawn", "tendon_newton/diagnosis/reporting/held_out.py",
        "theta=np.where(own.trusted, own.theta, np.nan)", "theta=own.theta",
        "tests/diagnosis/test_positions_alone.py -k follows_a_gap"),
    Mutation("names-from-logs-unchecked", "tendon_newton/data/importers/imported.py",
        "        check_name(self.recording.name, f", "        print(self.recording.name, f",
        "tests/contracts/test_names.py -k imported_log"),
    Mutation("link-followed-after-the-check", "tendon_newton/data/files/text_file.py",
        "if home is not None and os.path.commonpath(", "if False and os.path.commonpath(",
        "tests/bad_input/test_foreign_files.py -k link_out"),
    Mutation("load-cell-without-gravity", "hardware/tendon_hardware/load_cells/calibration.py",
        "slope, tare, error = line_through(points, gravity)",
        "slope, tare, error = line_through(points, 9.7)",
        "tests/hardware/load_cells/test_calibration.py"),
    Mutation("fingers-know-nothing-of-each-other",
        "tendon_newton/simulation/kernels/body_kernels.py",
        "ROUNDS = 2\n", "ROUNDS = 1\n", "tests/physics/contact/test_shared_body.py"),
    Mutation("clock-leaves-inertias", "tendon_newton/data/parameters.py",
        "TIME_POWERS.get(self.of or self.unit, 0)", "TIME_POWERS.get(self.unit, 0)",
        "tests/diagnosis/search/test_sets.py -k clock_changes"),
    Mutation("kernels-compile-in-each-process", "tendon_newton/device_code/templates.py",
        "self._sources.append(str(found))", "self._sources.append(repr(found))",
        "tests/contracts/test_references.py -k alike"),
)  # fmt: skip
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
