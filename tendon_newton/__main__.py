"""``python -m tendon_newton``: the command line."""

import sys


def main() -> int:
    """Run the verb that the program's arguments name."""
    from tendon_newton.cli import main as run
    from tendon_newton.safe_path import safe_children

    with safe_children():
        return run()


if __name__ == "__main__":
    if not sys.flags.safe_path:
        del sys.path[0]  # the current folder, which `python -m` puts before the standard library
    sys.exit(main())
