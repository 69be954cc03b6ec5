"""Find what a simulation of a tendon-driven finger leaves out, name it, and put it in."""

EXPORTS = {
    "ACTUATORS": "tendon_newton.actuators",
    "EFFECTS": "tendon_newton.effects",
    "FORCE_NETWORKS": "tendon_newton.force_networks",
    "ControlLoop": "tendon_newton.simulation.hosts.control_loop",
    "Dataset": "tendon_newton.data.dataset",
    "Diagnosis": "tendon_newton.diagnosis.result",
    "DifferentiableRollout": "tendon_newton.gradients.differentiable",
    "Mechanism": "tendon_newton.mechanisms.geometry.mechanism",
    "Model": "tendon_newton.data.model_file",
    "NamedValues": "tendon_newton.data.model_file",
    "Recording": "tendon_newton.data.recording",
    "Rollout": "tendon_newton.simulation.hosts.rollout",
    "TendonNewtonError": "tendon_newton.errors",
    "TendonSolver": "tendon_newton.simulation.hosts.tendon_solver",
    "build_model": "tendon_newton.mechanisms.worlds",
    "build_network": "tendon_newton.force_networks",
    "diagnose": "tendon_newton.diagnosis.diagnose",
    "load_dataset": "tendon_newton.data.dataset",
    "load_diagnosis": "tendon_newton.diagnosis.accounts.saved",
    "load_mechanism": "tendon_newton.mechanisms.loading",
    "load_model": "tendon_newton.data.model_file",
    "load_network": "tendon_newton.actuators.networks.artifact",
    "open_model": "tendon_newton.diagnosis.diagnosed_bench",
    "simulate": "tendon_newton.simulation.hosts.replay",
    "simulate_with_gradients": "tendon_newton.gradients.trajectory_gradient",
    "write_model": "tendon_newton.data.model_file",
}
"""What a user's program needs: name -> module. `docs/python.md` is a tour of it; the types are in
``__init__.pyi``. A module is loaded with its first name, so that this package costs nothing where
only recordings are read."""


def __getattr__(name: str) -> object:
    """Load a name when it is first asked for; ``__version__`` too, whose lookup takes time."""
    if name in EXPORTS:
        from importlib import import_module

        value = getattr(import_module(EXPORTS[name]), name)
        globals()[name] = value
        return value
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version

        try:
            return version("tendon-newton")
        except PackageNotFoundError:
            return source_version()
    raise AttributeError(f"module 'tendon_newton' has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the names for an interactive session."""
    return sorted({*EXPORTS, "__version__"})


def source_version() -> str:
    """Return the version of a source tree that is on the path and was not installed."""
    import tomllib
    from pathlib import Path

    project = Path(__file__).parents[1] / "pyproject.toml"
    if not project.is_file():
        return "unknown"
    return str(tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"])
