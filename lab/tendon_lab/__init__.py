"""What only this project's own lab needs: exams, and the reproduction of the paper.

A wheel has none of this. In a clone its verbs are verbs of ``tendon-newton`` as all others.
"""

VERBS: dict[str, str] = {
    "exam": "tendon_lab.verbs.exam",
    "reproduce": "tendon_lab.verbs.reproduce",
}
