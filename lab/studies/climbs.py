"""A climb of the stairs on a virtual bench, by a policy, kept in a file of its own."""

import contextlib
import io
import json
import tempfile
from pathlib import Path

from tendon_newton.cli import main as run_verb


def file_of(policy: Path, unit: int | str, out: Path) -> Path:
    """Return where a climb's numbers stand."""
    return out / f"{policy.resolve().parent.name}.unit_{unit}.json"


def climb(what: tuple[Path, int | str, Path]) -> str:
    """Let one policy climb on one unit, keep its numbers, and say in a line how it went.

    A unit may be 7_friction: number 7 whose gear has run dry.
    """
    policy, unit, out = what
    place = str(unit).replace("_", ":")
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        code = run_verb(
            [
                "evaluate-policy",
                str(policy),
                "--port",
                f"virtual:finger:{place}",
                "--out",
                folder,
                "--faster-than-real-time",
                "--no-plots",
                "--force",
            ]
        )
        if code:
            return f"{policy} on unit {unit}: exit code {code}"
        (found,) = json.loads((Path(folder) / "evaluation.json").read_text())["climbs"]
    path = file_of(policy, unit, out)
    path.with_suffix(".draft").write_text(json.dumps({"unit": unit, **found}, indent=1))
    path.with_suffix(".draft").replace(path)
    return f"{path.stem}: {1e3 * found['rmse']:.2f} mm"
