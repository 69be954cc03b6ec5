"""The table of CONTRIBUTING.md that says what an effect is given in each stage.

`python -m tests.stage_table` writes it there.
"""

import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from tendon_newton.effects import Stage
from tendon_newton.simulation.model.assembly import MEMORIES, STAGES
from tendon_newton.simulation.model.stage_fields import KNOWN_IN

CONTRIBUTING = Path(__file__).parents[1] / "CONTRIBUTING.md"
BEGIN, END = "<!-- python -m tests.stage_table -->\n", "<!-- end of the table -->\n"
DERIVATIVES = {
    "tendon": "wound string l [m], its rate [m/s]",
    "joint": "position [rad, m], velocity",
    None: "",
}
"""By what a jet is differentiated: that of a tendon, of a joint."""


def table_lines() -> Iterator[str]:
    """Return the table's lines: a row per stage, in the order of the signal."""
    heads = ("function", "is given", "returns", "its derivatives are by", "`tendon` lacks")
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    for stage in Stage:
        slot, _ = STAGES[stage]
        signature = inspect.signature(slot)
        names = [name for name in signature.parameters if name != "p"]
        owner = names[1] if names[1:] and names[1] != "time" else None
        jet = signature.return_annotation == "Jet"
        late = [f"`{field}`" for field, stages in KNOWN_IN.items() if stage not in stages]
        cells = (
            f"`{stage.value}`" + (" (may be remembered)" if stage in MEMORIES else ""),
            ", ".join(f"`{name}`" for name in [*names, "values"]),
            str(inspect.getdoc(slot)).rstrip("."),
            DERIVATIVES[owner] if jet else "",
            ", ".join(late) if owner == "tendon" else "",
        )
        yield f"| {' | '.join(cells)} |"


def with_table(text: str) -> str:
    """Return a text whose table is the present one."""
    table = "\n".join(table_lines())
    pattern = f"{re.escape(BEGIN)}.*?{re.escape(END)}"
    return re.sub(pattern, f"{BEGIN}\n{table}\n\n{END}", text, flags=re.DOTALL)


if __name__ == "__main__":
    CONTRIBUTING.write_text(with_table(CONTRIBUTING.read_text()))
    sys.exit(0)
