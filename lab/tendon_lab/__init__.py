"""What only this project's own lab needs: exams, the paper, and what was tried.

A wheel has none of this. In a clone its verbs are verbs of ``tendon-newton`` as all others.
"""

VERBS: dict[str, str] = {
    "evaluate-force": "tendon_lab.verbs.evaluate_force",
    "exam": "tendon_lab.verbs.exam",
    "reproduce": "tendon_lab.verbs.reproduce",
    "train-force-without-cell": "tendon_lab.verbs.train_force_without_cell",
}
