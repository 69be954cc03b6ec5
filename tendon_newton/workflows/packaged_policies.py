"""The policies that come with the program, by name."""

from pathlib import Path

from tendon_newton.data.files.text_file import absence
from tendon_newton.errors import InvalidPolicyFile, listed
from tendon_newton.mechanisms.asset_library import asset_folder


def policy_file(given: Path) -> Path:
    """Return the file of a policy that is given as one, or by the name of a packaged one.

    Raises:
        InvalidPolicyFile: There is no such file, nor a policy of that name.
    """
    known = {file.stem: file for file in sorted((asset_folder() / "policies").glob("*.onnx"))}
    if given.exists():
        return given
    if str(given) in known:
        return known[str(given)]
    raise InvalidPolicyFile(
        f"{given}: a policy is an ONNX or TorchScript file that train-policy writes; "
        f"{absence(given)}. Policies that come along, by name: {listed(known)}"
    )
