"""A policy from its file: the card checked, the network tried, ready for one observation a step.

An ONNX file is run by NumPy where that knows all its operations and by onnxruntime where not; a
TorchScript file by torch, where that is installed.
"""

from __future__ import annotations

import importlib
import io
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hardware.errors import PolicyFailure
from hardware.numpy_network import NumpyNetwork, UnsupportedOperation
from hardware.onnx_file import OnnxFile, parse_onnx
from tendon_newton.errors import (
    InvalidPolicyFile,
    MissingDependency,
    TendonNewtonError,
    UntrustedNetworkFile,
)
from tendon_newton.policy_card import CARD_KEY, CARD_NAME, CARD_SIZE_LIMIT, PolicyCard
from tendon_newton.text_file import absence
from tendon_newton.trust import VARIABLE, content_hash, trust_content, trusted_hashes

Engine = Literal["auto", "numpy", "onnxruntime"]
Observation = NDArray[np.float32]
FILE_SIZE_LIMIT = 1 << 26
"""Bytes; a policy has about 1 << 17."""
ZIP_START = b"PK"
"""First bytes of a TorchScript file, which is a zip archive."""
DAMAGE = (ValueError, NotImplementedError, EOFError, RuntimeError, OSError, zlib.error,
          struct.error, zipfile.BadZipFile)  # fmt: skip
"""What Python's zip reader raises at bytes that are none of an archive."""


@dataclass(frozen=True, kw_only=True)
class Policy:
    """A policy that was read and checked."""

    path: Path
    sha256: str
    card: PolicyCard
    engine: str
    """What runs it: numpy, onnxruntime or torch."""
    run: Callable[[Observation], Any]
    """Gives the output of an observation of shape (1, N)."""

    def __call__(self, observation: Observation) -> tuple[float, ...]:
        """Return the action that the policy wants of each servo [rad], before any cut.

        Raises:
            PolicyFailure: It could not be run, or gave something else than an action per servo.
        """
        try:
            output = tuple(float(value) for value in np.asarray(self.run(observation)).reshape(-1))
        except Exception as error:  # each engine fails in its own ways
            raise PolicyFailure(
                f"a policy must decide at every step; {self.path.name} failed: {first_line(error)}"
            ) from error
        if len(output) != self.card.servo_count:
            raise PolicyFailure(
                f"a policy must give one action for each servo, {self.card.servo_count}; "
                f"{self.path.name} gave {len(output)}"
            )
        return output


def load_policy(path: Path, *, engine: Engine = "auto", trust: bool = False) -> Policy:
    """Read a policy and make sure that it does what its card says.

    Args:
        path: The ONNX or TorchScript file.
        engine: What runs an ONNX file; ``auto`` is NumPy where it can.
        trust: Whether to trust a TorchScript file from now on: its code runs with the user's
            rights.

    Raises:
        InvalidPolicyFile: The file is damaged, has no card, or its network and card disagree.
        MissingDependency: It needs a package that is not installed.
        UntrustedNetworkFile: It is a TorchScript file that the user has not said to trust.
    """
    content = read_content(path)
    try:
        if content.startswith(ZIP_START):
            refuse_untrusted(content, path, trust=trust)
            card, name, run = torchscript_policy(content)
        else:
            card, name, run = onnx_policy(content, engine)
        policy = Policy(path=path, sha256=content_hash(content), card=card, engine=name, run=run)
        try_policy(policy)
    except InvalidPolicyFile as error:
        raise InvalidPolicyFile(f"{path}: {error}") from error
    return policy


def read_content(path: Path) -> bytes:
    """Read a file's bytes; the same bytes are hashed and run."""
    try:
        if not path.is_file():
            raise InvalidPolicyFile(f"{path}: a policy is an ONNX or TorchScript file; "
                                    f"{absence(path)}")  # fmt: skip
        size = path.stat().st_size
        if size > FILE_SIZE_LIMIT:
            raise InvalidPolicyFile(
                f"{path}: a policy has at most {FILE_SIZE_LIMIT:,} bytes; it has {size:,}"
            )
        return path.read_bytes()
    except OSError as error:
        raise InvalidPolicyFile(f"{path}: cannot be read: {error.strerror or error}") from error


def refuse_untrusted(content: bytes, path: Path, *, trust: bool) -> None:
    """Refuse a TorchScript file, which is a program, unless the user trusts it."""
    if trust:
        trust_content(content, path.name)
    elif content_hash(content) not in trusted_hashes():
        raise UntrustedNetworkFile(
            f"{path}: a TorchScript file is a program, and this one (SHA-256 "
            f"{content_hash(content)}) is not trusted; if you know where it comes from, add "
            f"--trust or set {VARIABLE} to its hash; an ONNX file needs no trust"
        )


def onnx_policy(content: bytes, engine: Engine) -> tuple[PolicyCard, str, Callable[..., Any]]:
    """Read card and network of an ONNX file."""
    file = parse_onnx(content)
    if CARD_KEY not in file.metadata:
        raise InvalidPolicyFile(
            f"a policy's metadata has the key {CARD_KEY!r} with its card; this file has "
            f"{', '.join(file.metadata) or 'none'}: was it written by `tendon-newton train-policy`?"
        )
    card = PolicyCard.from_json(file.metadata[CARD_KEY])
    if engine != "onnxruntime":
        try:
            return card, "numpy", NumpyNetwork(file)
        except UnsupportedOperation as error:
            if engine == "numpy":
                raise InvalidPolicyFile(
                    f"NumPy is not taught: {error}; let onnxruntime run it"
                ) from error
    return card, "onnxruntime", onnx_session(content, file)


def onnx_session(content: bytes, file: OnnxFile) -> Callable[[Observation], Any]:
    """Let onnxruntime run a network, on the loop's own core."""
    try:
        import onnxruntime  # large, and only where NumPy does not do
    except ModuleNotFoundError as error:
        raise MissingDependency(
            "this policy needs the package 'onnxruntime', which is not installed; "
            "pip install 'tendon-newton[hardware]'"
        ) from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4  # what is wrong comes as an exception
    try:
        session = onnxruntime.InferenceSession(content, options, ["CPUExecutionProvider"])
    except Exception as error:  # its exceptions have no common base
        raise InvalidPolicyFile(
            f"a network that onnxruntime can run; it says: {first_line(error)}"
        ) from error
    (name,) = file.inputs or ("",)

    def run(observation: Observation) -> Any:
        return session.run(None, {name: observation})[0]

    return run


def torchscript_policy(content: bytes) -> tuple[PolicyCard, str, Callable[..., Any]]:
    """Read card and network of a TorchScript file."""
    card = PolicyCard.from_json(zipped_card(content))
    try:
        torch: Any = importlib.import_module("torch")
    except ModuleNotFoundError as error:
        raise MissingDependency(
            "a TorchScript policy needs the package 'torch', which is not installed here; "
            "use the policy's ONNX file"
        ) from error
    with warnings.catch_warnings():  # PyTorch's advice to leave TorchScript
        warnings.filterwarnings("ignore", r"`torch\.jit\.\w+` is deprecated", DeprecationWarning)
        try:
            module = torch.jit.load(io.BytesIO(content), map_location="cpu").eval()
        except (RuntimeError, ValueError, AttributeError, EOFError) as error:
            raise InvalidPolicyFile(
                f"a TorchScript file that torch can read; it says: {first_line(error)}"
            ) from error
    torch.set_num_threads(1)

    def run(observation: Observation) -> Any:
        with torch.inference_mode():
            return module(torch.from_numpy(observation)).numpy()

    return card, "torch", run


def zipped_card(content: bytes) -> str:
    """Return the card in the zip archive that a TorchScript file is."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            cards = [i for i in archive.infolist() if i.filename.endswith(f"/extra/{CARD_NAME}")]
            if len(cards) != 1 or cards[0].file_size > CARD_SIZE_LIMIT:
                raise InvalidPolicyFile(
                    f"a policy has one card, extra/{CARD_NAME}, of at most {CARD_SIZE_LIMIT:,} "
                    f"bytes; this archive has {len(cards)} of "
                    f"{sum(card.file_size for card in cards):,}"
                )
            if (broken := archive.testzip()) is not None:  # torch itself may crash on one
                raise zipfile.BadZipFile(f"{broken} has the wrong checksum")
            return archive.read(cards[0]).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InvalidPolicyFile("card: must be UTF-8 text") from error
    except DAMAGE as error:
        raise InvalidPolicyFile(
            f"a TorchScript file is a zip archive; this one is damaged ({first_line(error)})"
        ) from error


def try_policy(policy: Policy) -> None:
    """Refuse a network that does not take the card's observations or act on its servos."""
    size, servos = policy.card.observation_size, policy.card.servo_count
    for level in (0.0, 1.0):
        observation = np.full((1, size), level, dtype=np.float32)
        try:
            with np.errstate(all="ignore"):
                output = np.asarray(policy.run(observation))
        except TendonNewtonError:
            raise
        except Exception as error:  # each engine fails in its own ways
            raise InvalidPolicyFile(
                f"must take observations of {size} numbers, as its card says; a test call "
                f"failed: {first_line(error)}"
            ) from error
        if output.size != servos or not np.issubdtype(output.dtype, np.floating):
            promise = "one action" if servos == 1 else f"{servos} actions, one for each servo,"
            raise InvalidPolicyFile(
                f"must give {promise} per observation; it gives an array of shape {output.shape}"
            )
        if not np.isfinite(output).all():
            raise InvalidPolicyFile("must give finite actions; a test call gave NaN or infinity")


def first_line(error: Exception) -> str:
    """Return the line of an engine's error that says what went wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return (lines[-1] if lines else type(error).__name__)[:200]
