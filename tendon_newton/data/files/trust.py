"""Which network files may run their code: those whose SHA-256 the user has said to trust.

A TorchScript file is a program: what is trusted may do whatever the user may, such as write any
file, and stays trusted. Weights alone (safetensors, ONNX) need no trust. The list is a text file in
the user's own configuration folder, one hash a line; ``TENDON_NEWTON_TRUST`` adds hashes for one
process, separated by commas.
"""

import os
import re
from pathlib import Path

from tendon_newton.data.files.origin import content_hash
from tendon_newton.errors import InvalidOutput, UntrustedNetworkFile

VARIABLE = "TENDON_NEWTON_TRUST"
HASH = re.compile(r"[0-9a-f]{64}")


def trust_file() -> Path:
    """Return where the list of trusted files is kept."""
    folder = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(folder) / "tendon-newton" / "trusted_networks.txt"


def trusted_hashes() -> frozenset[str]:
    """Return the hashes of the list and of the environment."""
    listed = trust_file()
    text = listed.read_text(encoding="utf-8", errors="replace") if listed.is_file() else ""
    # only the first word of a line: what follows is the name that a stranger gave the file
    first = [line.split(maxsplit=1)[0] for line in text.splitlines() if line.strip()]
    own = [word.strip() for word in os.environ.get(VARIABLE, "").split(",")]
    return frozenset(word for word in (*first, *own) if HASH.fullmatch(word))


def is_trusted(digest: str) -> bool:
    """Say whether a file of this SHA-256 may run: it was made here, or the user said so."""
    return digest in trusted_hashes()


def may_run(path: Path, content: bytes, *, trust: bool, instead: str) -> bool:
    """Return whether a TorchScript file was trusted before; else it must be tried first.

    Raises:
        UntrustedNetworkFile: Neither was it, nor does the user say so now.
    """
    known = is_trusted(digest := content_hash(content))
    if not (known or trust):
        raise UntrustedNetworkFile(
            f"{path}: a TorchScript file is a program, and this one (SHA-256 {digest}) is not "
            f"trusted; if you know where it comes from, add --trust or set {VARIABLE} to its hash; "
            f"{instead} file needs no trust"
        )
    return known


def trust_content(content: bytes, name: str) -> None:
    """Put a file on the list; its name stands there for the reader alone.

    Raises:
        InvalidOutput: The list cannot be written.
    """
    digest = content_hash(content)
    if is_trusted(digest):
        return
    path = trust_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(f"{digest}  {' '.join(name.split())}\n")
    except OSError as error:
        raise InvalidOutput(
            f"{path}: the list of trusted networks cannot be written: {error.strerror or error}"
        ) from error
