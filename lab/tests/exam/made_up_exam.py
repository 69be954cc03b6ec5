"""Made-up answers of an exam: one of each kind, right and wrong."""

from typing import Any

from tendon_lab.exam.exam_score import Family, Mark, Truth, judge

ORACLE = {"force_rmse": (1.0, 0.1), "theta_rmse": (0.1, 0.01)}


def truth(name: str, family: Family, *effects: str, **more: Any) -> Truth:
    """A truth whose effects all have one parameter of size 2."""
    settled: dict[str, Any] = {"outside": (), "near": (), "weak": False, "oracle": ORACLE, **more}
    return Truth(
        id=name, family=family, effects={effect: {"size": 2.0} for effect in effects}, **settled
    )


def answer(verdict: str, *classes: tuple[str, ...], rmse: float = 0.1) -> dict[str, Any]:
    """An answer that names the first of each class, with a parameter 10 % too large."""
    return {
        "verdict": verdict,
        "wall_time_s": 20.0,
        "peak_memory_mib": 600.0,
        "extended": {"force_rmse": rmse, "theta_rmse": 0.1 * rmse},
        "effects": [
            {
                "name": names[0],
                "indistinguishable_from": list(names[1:]),
                "parameters": {"size": {"value": 2.2, "ci95": [1.9, 2.5], "unit": "1"}},
            }
            for names in classes
        ],
    }


def marks() -> list[Mark]:
    """Ten answers: right, in a class, wrong, silent, of pairs, of nothing, and of the unknown."""
    cases = [
        (truth("a", "single", "command_delay"), answer("explained", ("command_delay",))),
        (truth("b", "single", "command_delay"), answer("explained", ("actuator_lag",), rmse=0.5)),
        (
            truth("c", "single", "actuator_lag"),
            answer("explained", ("command_delay", "actuator_lag")),
        ),
        (truth("d", "single", "tendon_slack"), answer("no_gap", rmse=1.0)),
        (
            truth("e", "pair", "gain_error", "tendon_slack"),
            answer("explained", ("tendon_slack",), ("gain_error",)),
        ),
        (
            truth("f", "pair", "gain_error", "tendon_slack"),
            answer("explained", ("gain_error",), ("deadband",)),
        ),
        (truth("g", "clean", oracle={}), answer("no_gap")),
        (truth("h", "clean", oracle={}), answer("explained", ("position_offset",))),
        (truth("i", "outside", outside=("hand_knocks",)), answer("unexplained", rmse=1.0)),
        (
            truth("j", "outside", outside=("command_jitter",), near=("command_delay",)),
            answer("partly_explained", ("command_delay",)),
        ),
    ]
    return [judge(true, said) for true, said in cases]
