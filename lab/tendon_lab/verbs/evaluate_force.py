"""Compare force networks with each other and with the ideal source on held-out recordings.

  tendon-newton evaluate-force recordings --networks networks --out comparison

The ideal source stands there twice: with the paper's 4.2 N/rad, and with the gain that fits the
train recordings best. A network wins only against the better one. Networks that differ in their
seed alone are one family. OUT gets evaluation.json with every number, and evaluation.md with the
tables.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True, kw_only=True)
class EvaluateForceConfig:
    """Compare force networks with each other and with the ideal source on held-out recordings."""

    dataset: Annotated[Path, tyro.conf.Positional]
    """Folder with dataset.toml and its recordings; its test recordings are used."""
    networks: tuple[Path, ...]  # Network files that train-force wrote, or folders of them.
    out: Path  # Folder for the results; made if it is not there.
    trust: bool = False
    """Trust these files from now on: a network file is a program and runs with your rights."""


def main(config: EvaluateForceConfig) -> None:
    """Evaluate, write and print the tables."""
    from tendon_newton.data.dataset import load_dataset
    from tendon_newton.data.files.json_file import write_json
    from tendon_newton.data.files.output_folder import make_folder
    from tendon_newton.data.files.text_file import write_text
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()

    from tendon_lab.force_scoring.compared_models import load_networks
    from tendon_lab.force_scoring.evaluation_file import to_markdown, to_table
    from tendon_lab.force_scoring.force_evaluation import evaluate

    dataset = load_dataset(config.dataset, require_train=False)
    networks = load_networks(config.networks, trust=config.trust)
    out = make_folder(config.out)
    evaluation = evaluate(networks, dataset)
    text = to_markdown(evaluation)
    write_json(out / "evaluation.json", to_table(evaluation))
    write_text(out / "evaluation.md", text)
    print(text)
    print(f"wrote {out / 'evaluation.json'} and evaluation.md")
