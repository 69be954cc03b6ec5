"""The bundled example is what its README says that it is."""

import re
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.dataset import load_dataset
from tests.planted.generator import main

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "hidden_friction"


@pytest.mark.slow
def test_the_generator_makes_the_example_again(tmp_path: Path) -> None:
    """Same files, commands and, but for rounding on another processor, forces."""
    text = (EXAMPLE / "README.md").read_text(encoding="utf-8")
    (seed,) = re.findall(r"--seed (\d+)", text)
    (effect,) = re.findall(r"`--effect (\w+)`", text)
    main([str(tmp_path / "again"), "--effect", effect, "--seed", seed])
    kept, made = load_dataset(EXAMPLE), load_dataset(tmp_path / "again")
    for ours, again in zip((*kept.train, *kept.test), (*made.train, *made.test), strict=True):
        assert ours.name == again.name
        np.testing.assert_array_equal(ours.command, again.command)
        assert float(np.mean(np.abs(ours.force - again.force))) < 1e-3


def test_the_example_stays_small() -> None:
    """It is part of every clone: under a megabyte."""
    assert sum(file.stat().st_size for file in EXAMPLE.iterdir()) < 1_000_000
