"""What only this project's own lab needs: exams, the paper, and what was tried.

Its verbs and log formats are a plug-in of ``tendon-newton``: ``pyproject.toml`` beside names them.
"""
