"""What encoders on joints tell beside angle and force: ``python -m lab.studies.joint_angles``.

Planted sets of one to three causes come from a plant that shares no code with the simulator. Each
is diagnosed from the motor's angle and the force alone, as ever, and with the joints' angles.
"""

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.data.recording import Recording
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.result import Diagnosis
from tests.planted.generator import Recipe, make_dataset

SETS: tuple[tuple[str, ...], ...] = (
    (),
    ("load_cell_gain",),
    ("gain_error",),
    ("spool_radius_error",),
    ("joint_stiffness_error",),
    ("tendon_compliance",),
    ("tendon_slack",),
    ("position_offset",),
    ("routing_friction", "coulomb_friction"),
    ("spool_radius_error", "gain_error"),
    ("tendon_compliance", "joint_stiffness_error", "command_delay"),
)
BENCHES = ("S", "F")  # A slider and a finger, keys of `tests.planted.recordings.MIXES`
DURATION = (4.0, 5.0)  # Length of each recording [s]
SIGNALS = {"as ever": (), "joint angles too": ("joint_position",)}


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What one diagnosis said of a planted set."""

    planted: tuple[str, ...]
    bench: str
    seed: int
    signals: str  # Key of `SIGNALS`
    named: dict[str, tuple[str, ...]]  # Each named cause with the names of its class
    left: dict[str, float]  # Held-out RMS errors of the extended model, each in its unit
    seconds: float

    @property
    def found(self) -> int:
        """Planted causes that are named, alone or in a class."""
        return sum(any(c in (n, *r) for n, r in self.named.items()) for c in self.planted)

    @property
    def alone(self) -> int:
        """Planted causes that are named with no rival."""
        return sum(self.named.get(cause) == () for cause in self.planted)

    @property
    def false(self) -> int:
        """Names whose class holds no planted cause."""
        return sum(not {n, *r} & {*self.planted} for n, r in self.named.items())


def seen(dataset: Dataset, signals: Sequence[str]) -> Dataset:
    """Return a dataset with motor angle, force and some further signals."""

    def less(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        hidden = {name: None for name in ("joint_position", "tip") if name not in signals}
        return tuple(replace(recording, **hidden) for recording in recordings)

    return replace(dataset, train=less(dataset.train), test=less(dataset.test))


def answers(recipe: Recipe, budget: float | None) -> Iterator[Answer]:
    """Plant a set and diagnose it with each choice of signals."""
    with tempfile.TemporaryDirectory() as folder:
        make_dataset(Path(folder), recipe)
        dataset, model = load_dataset(folder), load_model(Path(folder) / "model.toml")
        for words, signals in SIGNALS.items():
            found, _ = diagnose(
                seen(dataset, signals), model, progress=lambda _: None, budget=budget
            )
            yield Answer(
                planted=recipe.effects, bench=recipe.mix, seed=recipe.seed, signals=words,
                named=classes(found), left=found.extended.to_json(), seconds=found.wall_time_s,
            )  # fmt: skip


def classes(found: Diagnosis) -> dict[str, tuple[str, ...]]:
    """Return the named causes, each with those that the data cannot tell from it."""
    return {effect.name: effect.indistinguishable_from for effect in found.effects}


def table(found: Sequence[Answer]) -> list[str]:
    """Sum the answers up, a row for each choice of signals."""
    out = [
        "| compared | planted | found | alone | class sizes | false names | seconds |",
        "|---|---|---|---|---|---|---|",
    ]
    for words in SIGNALS:
        own = [answer for answer in found if answer.signals == words]
        sizes = [1 + len(rivals) for answer in own for rivals in answer.named.values()]
        planted = sum(len(answer.planted) for answer in own)
        out.append(
            f"| {words} | {planted} | {sum(a.found for a in own)} | {sum(a.alone for a in own)} | "
            f"{sum(sizes) / max(1, len(sizes)):.2f} | {sum(a.false for a in own)} | "
            f"{sum(a.seconds for a in own) / max(1, len(own)):.0f} |"
        )
    return out


def main() -> None:
    """Plant, diagnose, and print each answer and the table."""
    parser = argparse.ArgumentParser(description="What encoders on joints tell.")
    parser.add_argument("--bench", choices=BENCHES, nargs="+", default=BENCHES)
    parser.add_argument("--seeds", type=int, nargs="+", default=(2,))
    parser.add_argument("--budget", type=float, default=None, help="of each diagnosis [s]")
    parser.add_argument("--sets", type=int, nargs="+", default=range(len(SETS)))
    parser.add_argument("--size", type=float, default=1.0, help="of the causes [1]")
    parser.add_argument("--without-force", action="store_true", help="no load cell")
    parser.add_argument("--off-nominal", type=float, default=0.0, help="of the drawing [1]")
    asked = parser.parse_args()
    quiet_warp()
    found: list[Answer] = []
    for seed in asked.seeds:
        for bench in asked.bench:
            for place in asked.sets:
                recipe = Recipe(
                    effects=SETS[place], seed=seed, mix=bench, duration=DURATION, on_joint=True,
                    size=asked.size, without_force=asked.without_force,
                    off_nominal=asked.off_nominal,
                )  # fmt: skip
                for answer in answers(recipe, asked.budget):
                    found.append(answer)
                    print(json.dumps(vars(answer)), flush=True)
    print("\n".join(table(found)))


if __name__ == "__main__":
    main()
