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


def table_lines() -> Iterator[str]:
    """Return the table's lines: a row per stage, in the order of the signal."""
    heads = ("function", "is given", "returns", "`tendon` lacks")
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    for stage in Stage:
        slot, _ = STAGES[stage]
        names = [name for name in inspect.signature(slot).parameters if name != "p"]
        late = [f"`{field}`" for field, stages in KNOWN_IN.items() if stage not in stages]
        cells = (
            f"`{stage.value}`" + (" (may be remembered)" if stage in MEMORIES else ""),
            ", ".join(f"`{name}`" for name in names),
            str(inspect.getdoc(slot)).rstrip("."),
            ", ".join(late) if "tendon" in names else "",
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
