"""Sizes of a reproduction: full as in the paper, or quick."""

from dataclasses import dataclass

from tendon_newton.errors import InvalidParameter, look_up
from tendon_train.actuator.training_config import Kind, Purpose, TrainingConfig


@dataclass(frozen=True, kw_only=True)
class ReproductionSettings:
    """Everything that decides the numbers of a reproduction, besides the recordings."""

    name: str  # ``quick`` or ``full``; the tables are marked with it.
    units: tuple[int, ...]  # Benches; the first one is looked at most closely.
    seed: int = 0  # Seed of the recordings' draws and of the networks' starting weights.
    runs_of_kind: int | None = None
    """Train recordings of each kind on the benches after the first; all of the plan if none."""
    epochs: int = 30  # Epochs of each force network.
    windows_per_epoch: int = 32768  # Windows that an epoch draws.
    kinds: tuple[Kind, ...] = ("transformer", "rnn", "mlp")
    """Force networks that are compared on the first bench; the first kind is used throughout."""
    diagnosis_seconds: float = 4.0
    """Length of each recording in which a diagnosis looks for causes [s]. A diagnosis tries
    thousands of models, and its time grows with the data. The diagnosis sees one recording of each
    bench and kind."""
    diagnosis_kinds: int = 2
    """Kinds of recordings that it sees: steps, sinusoids, ramps, in this order."""
    refit_seconds: float = 30.0
    """Length of each recording to which the numbers of the named causes are fitted [s]."""
    refit_kinds: int = 3  # Kinds of those recordings.
    diagnosis_passes: int = 2
    """Diagnoses at most, each going on from the model that the one before has extended."""
    diagnoses_each_unit: bool = False
    """Whether every bench is diagnosed, or the causes of the first are refitted on the others."""
    time_step: float = 2.5e-4  # Longest step of the closed-loop simulations [s].

    def __post_init__(self) -> None:
        """Refuse what would leave nothing to compare."""
        if not self.units or len(set(self.units)) < len(self.units) or min(self.units) < 0:
            raise InvalidParameter(
                f"units must be one or more different whole numbers from 0; they are {self.units}"
            )
        if self.seed < 0:
            raise InvalidParameter(f"seed must not be negative; it is {self.seed}")
        for name in ("diagnosis_seconds", "refit_seconds"):
            if not getattr(self, name) >= 2.0:
                raise InvalidParameter(f"{name} must be 2 s or more; it is {getattr(self, name)}")

    def training(self, kind: Kind | None = None, purpose: Purpose = "prediction") -> TrainingConfig:
        """Return how a force network is trained."""
        return TrainingConfig(
            network=kind or self.kinds[0],
            purpose=purpose,
            seed=self.seed,
            epochs=self.epochs,
            windows_per_epoch=self.windows_per_epoch,
        )


QUICK = ReproductionSettings(
    name="quick",
    units=(0, 1, 2, 3, 4),
    runs_of_kind=1,
    epochs=6,
    windows_per_epoch=16384,
    refit_seconds=8.0,
    refit_kinds=2,
    diagnosis_passes=1,
    kinds=("transformer",),
    time_step=5.0e-4,
)
FULL = ReproductionSettings(
    name="full", units=(0, 1, 2, 3, 4, 5, 6, 7, 8, 9), diagnoses_each_unit=True
)
SETTINGS: dict[str, ReproductionSettings] = {"quick": QUICK, "full": FULL}


def find_settings(name: str) -> ReproductionSettings:
    """Return settings by their name; an unknown one is refused."""
    return look_up("settings", name, SETTINGS)
