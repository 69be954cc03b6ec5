"""Exams: ``python -m lab.exams.draw OUT --cases 60 --seed 1000``.

Writes OUT/pNNN/dataset.toml with its recordings and model.toml, and OUT/truth/pNNN.json.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lab.exams.exam_draws import MIX_SHARES, SHARES, ExamPlan, are_alike, recipes
from tests.planted.generator import Recipe, make_dataset, starting_model
from tests.planted.sets.draws import EFFECTS
from tests.planted.truth import Truth


def write_exam(out: Path, plan: ExamPlan, prefix: str = "p") -> None:
    """Make all datasets of an exam, and their truths beside them; names are prefix and number."""
    truths = out / "truth"
    truths.mkdir(parents=True, exist_ok=True)
    for number, recipe in enumerate(recipes(plan), start=1):
        name = f"{prefix}{number:03d}"
        truth = make_dataset(out / name, recipe)
        text = json.dumps(told(name, recipe, truth), indent=1)
        (truths / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def told(name: str, recipe: Recipe, truth: Truth) -> dict[str, Any]:
    """Tell a truth with the circumstances under which it has to be found."""
    known = starting_model(known_friction=recipe.known_friction, mix=recipe.mix).effects
    return {
        "id": name,
        "realistic": recipe.known_friction,
        "mix": recipe.mix,
        **truth.to_json(),
        "alike": len(recipe.effects) == 2 and are_alike(recipe.effects),
        "known_effects": [
            {"name": effect.name, "parameters": dict(effect.values)} for effect in known
        ],
        "cell_rate": recipe.cell_rate,
        "gaps": recipe.gaps,
        "noise": {"force": recipe.force_noise, "colour": recipe.noise_colour},
        "off_nominal": recipe.off_nominal,
        "imperfection": recipe.imperfection,
        "second_form": recipe.second_form,
        "without_force": recipe.without_force,
        "bristle": truth.bristle,
        "seed": recipe.seed,
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Make an exam from the command line."""
    plan = ExamPlan()
    parser = argparse.ArgumentParser(description="Make an exam of datasets with planted causes.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--cases", type=int, default=plan.cases)
    parser.add_argument("--seed", type=int, default=plan.seed)
    parser.add_argument("--families", nargs="+", choices=list(SHARES), default=plan.families)
    parser.add_argument("--effects", nargs="+", choices=list(EFFECTS), default=plan.effects)
    parser.add_argument("--mixes", nargs="+", choices=list(MIX_SHARES), default=plan.mixes)
    parser.add_argument("--colours", nargs="+", type=float, default=plan.colours)
    for share in ("known-friction", "alike-share", "cell-rate-share", "gaps-share", "weak-share"):
        default = getattr(plan, share.replace("-", "_"))
        parser.add_argument(f"--{share}", type=float, default=default, help="of the cases [1]")
    parser.add_argument("--off-nominal", type=float, default=plan.off_nominal)
    parser.add_argument("--imperfection", type=float, default=plan.imperfection)
    parser.add_argument("--second-form", action="store_true", help="of the plant")
    parser.add_argument("--without-force", action="store_true", help="no load cell")
    parser.add_argument("--prefix", default="p", help="of the datasets' names")
    chosen = vars(parser.parse_args(arguments))
    out: Path = chosen.pop("out")
    prefix: str = chosen.pop("prefix")
    settled = {k: tuple(v) if isinstance(v, list) else v for k, v in chosen.items()}
    write_exam(out, ExamPlan(**settled), prefix)


if __name__ == "__main__":
    main()
