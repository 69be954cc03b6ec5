"""Find what a simulation of a tendon-driven finger leaves out, name it, and put it in."""

from importlib.metadata import PackageNotFoundError, version


def __getattr__(name: str) -> str:
    """Read ``__version__`` only when asked: the lookup costs more than the rest of the import."""
    if name == "__version__":
        try:
            return version("tendon-newton")
        except PackageNotFoundError:
            return source_version()
    raise AttributeError(f"module 'tendon_newton' has no attribute {name!r}")


def source_version() -> str:
    """Return the version of a source tree that is on the path and was not installed."""
    import tomllib
    from pathlib import Path

    project = Path(__file__).parents[1] / "pyproject.toml"
    if not project.is_file():
        return "unknown"
    return str(tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"])
