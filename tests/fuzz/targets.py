"""Every format that the program reads: a sound file of it, what spoils it, and what reads it.

A target's `prepare` writes a sound folder and returns the file to spoil; `read` gets that file and
returns, or raises an error of ours. Everything heavy is imported inside, by the worker alone.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.fuzz.mutations import Change, change_cells, change_lines, either, flip, table_changer


@dataclass(frozen=True, kw_only=True)
class Target:
    """One format."""

    prepare: Callable[[Path], Path]
    change: Change
    read: Callable[[Path], Any]
    share: float = 1.0  # How many of its files are tried, against those of others


def toml_of(table: Any) -> Callable[[bytes, Any], bytes]:
    """Return a change of the values of a TOML file."""
    import tomli_w

    return table_changer(table, tomli_w.dumps)


def put(name: str, content: str | bytes) -> Callable[[Path], Path]:
    """Prepare a folder of one file."""

    def prepare(folder: Path) -> Path:
        path = folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return prepare


def recordings() -> dict[str, Target]:
    """CSV, MCAP and bags, datasets and mappings of topics."""
    from tests.fuzz import logs

    return {
        "csv": Target(
            prepare=logs.csv_file,
            change=either(change_cells, change_cells, change_lines, flip),
            read=logs.read_csv_twice,
            share=2.0,
        ),
        "dataset": Target(
            prepare=logs.dataset_folder, change=toml_of(logs.DATASET), read=logs.read_dataset
        ),
        "mcap": Target(prepare=logs.mcap_file, change=flip, read=logs.read_mcap_file, share=2.0),
        "mcap-schema": Target(
            prepare=logs.plain_mcap_file,
            change=logs.change_definitions,
            read=logs.read_mcap_file,
            share=2.0,
        ),
        "mcap-steps": Target(prepare=logs.plain_mcap_file, change=flip, read=logs.read_steps),
        "topics": Target(
            prepare=logs.topics_file, change=either(change_lines, flip), read=logs.read_topics
        ),
        "bag": Target(prepare=logs.bag_file, change=flip, read=logs.read_bag, share=0.15),
        "bag-yaml": Target(
            prepare=logs.bag_yaml, change=either(change_lines, flip), read=logs.read_bag, share=0.15
        ),
    }


def settings() -> dict[str, Target]:
    """Models, diagnoses, truths, calibrations, goals."""
    from tests.fuzz import tables

    return {
        "model": Target(
            prepare=tables.model_file, change=toml_of(tables.MODEL), read=tables.read_model
        ),
        "diagnosis": Target(
            prepare=put("diagnosis.json", json.dumps(tables.ANSWER)),
            change=table_changer(tables.ANSWER, json.dumps),
            read=tables.read_finite_diagnosis,
        ),
        "arm": Target(
            prepare=tables.arm_folder,
            change=table_changer(tables.ARM, json.dumps),
            read=tables.read_sound_arm,
            share=0.3,
        ),
        "truth": Target(
            prepare=put("c001.json", json.dumps(tables.TRUTH)),
            change=table_changer(tables.TRUTH, json.dumps),
            read=tables.read_truth_file,
        ),
        "class": Target(
            prepare=tables.open_folder,
            change=table_changer(tables.OPEN, json.dumps),
            read=tables.read_left_open,
        ),
        "calibration": Target(
            prepare=tables.calibration_file,
            change=either(change_lines, flip),
            read=tables.read_calibration,
        ),
        "goals": Target(
            prepare=put("goals.txt", "0 0.1\n1.5, 0.9\n3 0\n# end\n"),
            change=either(change_lines, flip),
            read=tables.read_goal_file,
        ),
        "policy-card": Target(
            prepare=tables.policy_card_file,
            change=tables.change_policy_card,
            read=tables.read_policy_card,
        ),
        "force-card": Target(
            prepare=tables.force_card_file,
            change=tables.change_force_card,
            read=tables.read_force_card,
        ),
    }


def foreign_logs() -> dict[str, Target]:
    """Logs of other programs, and the mappings that explain them."""
    from tendon_lab.foreign_logs.bam import read_parameters
    from tests.fuzz import imports

    return {
        "mapped-csv": Target(
            prepare=imports.mapped_csv,
            change=either(change_cells, change_lines, flip),
            read=imports.read_mapped_folder,
        ),
        "mapped-json": Target(
            prepare=imports.mapped_json,
            change=table_changer(imports.JSON_ROWS, json.dumps),
            read=imports.read_mapped_folder,
        ),
        "mapping": Target(
            prepare=imports.mapping_file,
            change=toml_of(imports.MAPPING),
            read=imports.read_with_mapping,
        ),
        "xl330": Target(
            prepare=imports.xl330_file, change=imports.change_json, read=imports.read_xl330_folder
        ),
        "bam": Target(
            prepare=imports.bam_file, change=imports.change_json, read=imports.read_bam_folder
        ),
        "bam-parameters": Target(
            prepare=imports.bam_parameter_file, change=imports.change_json, read=read_parameters
        ),
        "lerobot": Target(
            prepare=imports.lerobot_rows, change=flip, read=imports.read_lerobot_rows, share=0.2
        ),
        "lerobot-info": Target(
            prepare=imports.lerobot_info,
            change=imports.change_json,
            read=imports.read_lerobot_info,
            share=0.2,
        ),
        "so101": Target(
            prepare=imports.so101_file,
            change=either(change_cells, change_lines, flip),
            read=imports.read_so101_folder,
        ),
    }


def assets() -> dict[str, Target]:
    """USD in both forms, and what is imported."""
    from tests.fuzz import usd

    return {
        "usda": Target(
            prepare=usd.text_asset,
            change=either(change_lines, flip),
            read=usd.read_asset,
            share=0.5,
        ),
        "usdc": Target(prepare=usd.binary_asset, change=flip, read=usd.read_asset, share=0.5),
        "mjcf": Target(
            prepare=usd.mjcf_file,
            change=either(change_lines, flip),
            read=usd.read_import,
            share=0.5,
        ),
        "urdf": Target(
            prepare=usd.urdf_file,
            change=either(change_lines, flip),
            read=usd.read_import,
            share=0.5,
        ),
    }


def models() -> dict[str, Target]:
    """Policies, force networks and checkpoints."""
    from tests.fuzz import networks

    return {
        "policy-onnx": Target(
            prepare=networks.policy_onnx,
            change=networks.flip_structure,
            read=networks.read_policy,
            share=0.2,
        ),
        "policy-pt": Target(
            prepare=networks.policy_script, change=flip, read=networks.read_policy, share=0.1
        ),
        "force-onnx": Target(
            prepare=networks.force_onnx,
            change=networks.flip_structure,
            read=networks.read_estimate,
            share=0.2,
        ),
        "force-pt": Target(
            prepare=networks.force_script, change=flip, read=networks.read_network, share=0.1
        ),
        "force-weights": Target(
            prepare=networks.force_weights, change=networks.flip_head, read=networks.read_network
        ),
        "checkpoint": Target(
            prepare=networks.checkpoint, change=flip, read=networks.read_checkpoint
        ),
        "policy-checkpoint": Target(
            prepare=networks.policy_checkpoint, change=flip, read=networks.read_policy_checkpoint
        ),
    }


GROUPS: dict[str, Callable[[], dict[str, Target]]] = {
    "recordings": recordings,
    "settings": settings,
    "logs": foreign_logs,
    "assets": assets,
    "models": models,
}
"""Groups of targets; a worker loads one."""
