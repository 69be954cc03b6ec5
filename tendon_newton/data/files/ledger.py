"""How far work of several stages has come, in a file, so that it can go on."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.files.values import is_table
from tendon_newton.errors import InvalidOutput, shown

PROMISE = "how far the work in a folder has come stands in a JSON file"


class Ledger:
    """Results of the stages that are done, on disk after each; a folder holds those of one input.

    Args:
        path: The file; it is read where it is there.
        inputs: All that decides the results: settings, and a hash of each file that is read.

    Raises:
        InvalidOutput: The file belongs to work on other inputs.
    """

    def __init__(self, path: Path, inputs: Mapping[str, Any]) -> None:
        self.path = path
        self.inputs: dict[str, Any] = json.loads(json.dumps(dict(inputs)))
        self._stages: dict[str, Any] = {}
        if path.exists():
            table = read_json(path, InvalidOutput, PROMISE)
            self._refuse_other(table.get("inputs"))
            stages = table.get("stages")
            self._stages = stages if is_table(stages) else {}

    def done(self, stage: str) -> Any:
        """Return the result of a stage, None where it is still to be done."""
        return self._stages.get(stage)

    def finish(self, stage: str, result: Any) -> None:
        """Keep the result of a stage; the file is written whole or not at all."""
        self._stages[stage] = json.loads(json.dumps(result))
        write_json(self.path, {"inputs": self.inputs, "stages": self._stages})

    def _refuse_other(self, saved: Any) -> None:
        saved = saved if is_table(saved) else {}
        for key, value in self.inputs.items():
            if saved.get(key) != value:
                raise InvalidOutput(
                    f"{self.path}: what is here began with {key} = {shown(saved.get(key))}, and "
                    f"now it is {shown(value)}; use another folder"
                )
