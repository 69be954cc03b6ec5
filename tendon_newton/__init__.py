"""Find what a simulation of a tendon-driven finger leaves out, name it, and put it in."""

from importlib.metadata import version


def __getattr__(name: str) -> str:
    """Read ``__version__`` only when asked: the lookup costs more than the rest of the import."""
    if name == "__version__":
        return version("tendon-newton")
    raise AttributeError(f"module 'tendon_newton' has no attribute {name!r}")
