"""The folder of a new asset: its layers from templates, never over another one."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tendon_newton.errors import InvalidOutput


def write_layers(
    folder: Path,
    templates: str,
    layers: Sequence[str],
    plan: Any,
    filters: Mapping[str, Callable[..., str]],
) -> Path:
    """Write the layers of an asset into a new folder of its name, and return the file to open.

    Each layer has a template; ``interface`` becomes the file to open. Filters say how numbers are
    written.

    Raises:
        InvalidOutput: The new folder is there already, or cannot be made.
    """
    from jinja2 import Environment, PackageLoader

    pages = Environment(
        loader=PackageLoader("tendon_newton.mechanisms.authoring", templates),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    pages.filters.update(filters)
    home = folder / plan.name
    try:
        home.mkdir(parents=True)
        for layer in layers:
            text = pages.get_template(f"{layer}.usda.jinja").render(plan=plan)
            name = plan.name if layer == "interface" else layer
            (home / f"{name}.usda").write_text(text, encoding="utf-8")
    except FileExistsError as error:
        raise InvalidOutput(
            f"{home}: a new asset gets a new folder; it is there already"
        ) from error
    except OSError as error:
        raise InvalidOutput(
            f"{home}: an asset needs a folder; {error.strerror or error}"
        ) from error
    return home / f"{plan.name}.usda"
