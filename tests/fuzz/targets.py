"""Every format that the program reads: a sound file of it, what spoils it, and what reads it.

A target's `prepare` writes a sound folder and returns the file to spoil; `read` gets that file and
returns, or raises an error of ours. Everything heavy is imported inside, by the worker alone.
"""

import importlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.fuzz.mutations import Change, change_cells, change_lines, either, flip, table_changer


@dataclass(frozen=True)
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
            logs.csv_file,
            either(change_cells, change_cells, change_lines, flip),
            logs.read_csv_twice,
            share=2.0,
        ),
        "dataset": Target(logs.dataset_folder, toml_of(logs.DATASET), logs.read_dataset),
        "mcap": Target(logs.mcap_file, flip, logs.read_mcap_file, share=2.0),
        "mcap-schema": Target(
            logs.plain_mcap_file, logs.change_definitions, logs.read_mcap_file, share=2.0
        ),
        "mcap-steps": Target(logs.plain_mcap_file, flip, logs.read_steps),
        "topics": Target(logs.topics_file, either(change_lines, flip), logs.read_topics),
        "bag": Target(logs.bag_file, flip, logs.read_bag, share=0.15),
        "bag-rows": Target(logs.bag_of_rows, flip, logs.import_bag, share=0.3),
        "bag-mapping": Target(
            logs.bag_mapping, either(change_lines, flip), logs.import_bag, share=0.3
        ),
        "bag-yaml": Target(logs.bag_yaml, either(change_lines, flip), logs.read_bag, share=0.15),
    }


def settings() -> dict[str, Target]:
    """Models, diagnoses, calibrations, goals."""
    from tests.fuzz import tables

    return {
        "model": Target(tables.model_file, toml_of(tables.MODEL), tables.read_model),
        "diagnosis": Target(
            put("diagnosis.json", json.dumps(tables.ANSWER)),
            table_changer(tables.ANSWER, json.dumps),
            tables.read_finite_diagnosis,
        ),
        "arm": Target(
            tables.arm_folder,
            table_changer(tables.ARM, json.dumps),
            tables.read_sound_arm,
            share=0.3,
        ),
        "arm-motions": Target(
            tables.arm_motions,
            either(change_cells, change_cells, change_lines, flip),
            tables.stand_arm,
            share=0.3,
        ),
        "posterior": Target(tables.posterior_folder, tables.change_json_text, tables.draw_worlds),
        "servo": Target(tables.servo_folder, tables.change_json_text, tables.read_servo),
        "against": Target(
            tables.earlier_folder, table_changer(tables.OPEN, json.dumps), tables.read_earlier
        ),
        "changes": Target(tables.changes_file, tables.change_json_text, tables.read_changes),
        "class": Target(
            tables.open_folder, table_changer(tables.OPEN, json.dumps), tables.read_left_open
        ),
        "calibration": Target(
            tables.calibration_file, either(change_lines, flip), tables.read_calibration
        ),
        "goals": Target(
            put("goals.txt", "0 0.1\n1.5, 0.9\n3 0\n# end\n"),
            either(change_lines, flip),
            tables.read_goal_file,
        ),
        "policy-card": Target(
            tables.policy_card_file, tables.change_policy_card, tables.read_policy_card
        ),
        "force-card": Target(
            tables.force_card_file, tables.change_force_card, tables.read_force_card
        ),
    }


def foreign_logs() -> dict[str, Target]:
    """Logs of other programs, and the mappings that explain them."""
    from tests.fuzz import imports

    return {
        "mapped-csv": Target(
            imports.mapped_csv, either(change_cells, change_lines, flip), imports.read_mapped_folder
        ),
        "mapped-json": Target(
            imports.mapped_json,
            table_changer(imports.JSON_ROWS, json.dumps),
            imports.read_mapped_folder,
        ),
        "mapping": Target(
            imports.mapping_file, toml_of(imports.MAPPING), imports.read_with_mapping
        ),
        "lerobot": Target(imports.lerobot_rows, flip, imports.read_lerobot_rows, share=0.2),
        "lerobot-info": Target(
            imports.lerobot_info, imports.change_json, imports.read_lerobot_info, share=0.2
        ),
    }


def assets() -> dict[str, Target]:
    """USD in both forms, and what is imported."""
    from tests.fuzz import usd

    return {
        "usda": Target(usd.text_asset, either(change_lines, flip), usd.read_asset, share=0.5),
        "usdc": Target(usd.binary_asset, flip, usd.read_asset, share=0.5),
        "mjcf": Target(usd.mjcf_file, either(change_lines, flip), usd.read_import, share=0.5),
        "urdf": Target(usd.urdf_file, either(change_lines, flip), usd.read_import, share=0.5),
    }


def models() -> dict[str, Target]:
    """Policies, force networks and checkpoints."""
    from tests.fuzz import networks

    return {
        "policy-onnx": Target(
            networks.policy_onnx, networks.flip_structure, networks.read_policy, share=0.2
        ),
        "policy-pt": Target(networks.policy_script, flip, networks.read_policy, share=0.1),
        "force-onnx": Target(
            networks.force_onnx, networks.flip_structure, networks.read_estimate, share=0.2
        ),
        "force-pt": Target(networks.force_script, flip, networks.read_network, share=0.1),
        "force-weights": Target(networks.force_weights, networks.flip_head, networks.read_network),
        "checkpoint": Target(networks.checkpoint, flip, networks.read_checkpoint),
        "policy-checkpoint": Target(
            networks.policy_checkpoint, flip, networks.read_policy_checkpoint
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
PRODUCT = __name__


def groups_in(module: str) -> dict[str, Callable[[], dict[str, Target]]]:
    """Return the groups of a module: this one, or another with files of its own."""
    return importlib.import_module(module).GROUPS
