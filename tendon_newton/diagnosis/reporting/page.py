"""Pages of HTML that need nothing else, from templates beside the code."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tendon_newton.data.files.text_file import write_text


def write_page(path: Path, package: str, template: str, content: Mapping[str, Any]) -> None:
    """Fill a template and write the page.

    Args:
        package: Package that holds the template; it may build on those of this one.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    packages = (package, "tendon_newton.diagnosis.reporting")
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name, ".") for name in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    write_text(path, environment.get_template(template).render(content))
