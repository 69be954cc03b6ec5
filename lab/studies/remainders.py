"""What the learner sees in what no effect explains: ``python -m lab.studies.remainders``.

Prints one row per planted dataset: right models first, then causes outside the catalogue.
"""

import tempfile
from pathlib import Path

import warp as wp

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.unexplained.remainder_structure import find_structure
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study
from tests.planted.generator import Recipe, make_dataset
from tests.planted.sets.draws import OUTSIDE

TIME_STEP = 5.0e-4  # [s] as a diagnosis simulates
RIGHT = {
    "right model": Recipe(seed=5),
    "right model, slow noise": Recipe(seed=7, noise_colour=0.9),
    "right model, friction known": Recipe(seed=6, known_friction=True),
    "the same, another servo": Recipe(seed=8, known_friction=True, noise_colour=0.6),
}


def main() -> None:
    """Make the datasets, look at each and print what was seen."""
    wp.config.log_level = wp.LOG_ERROR
    recipes = {**RIGHT, **{name: Recipe(effects=(name,), seed=5) for name in OUTSIDE}}
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, recipe) in enumerate(recipes.items()):
            print(row(name, Path(folder) / str(number), recipe), flush=True)


def row(name: str, folder: Path, recipe: Recipe) -> str:
    """Return one line of the table."""
    make_dataset(folder, recipe)
    model = load_model(folder / "model.toml")
    study = Study(load_dataset(folder).train, model, tuple(EFFECTS), time_step=TIME_STEP)
    seen = find_structure(study, {})
    found = f"{seen.side}: {', '.join(seen.depends_on)}" if seen.found else "-"
    return f"{name:28s} R2 {seen.held_out_r2:6.2f}  p {seen.p_value:.3f}  {found}"


if __name__ == "__main__":
    main()
