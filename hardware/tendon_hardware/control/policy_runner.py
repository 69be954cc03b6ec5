"""A policy from its file: the card checked, the network tried, ready for one observation a step.

An ONNX file is run by onnxruntime, a TorchScript file by torch, where that is installed. A file
that comes from somebody else is first tried in a process of its own, where it can do no harm by
its size.
"""

import importlib
import io
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_hardware.control.onnx_operators import refuse_operators
from tendon_hardware.errors import PolicyFailure
from tendon_newton.data.cards.policy_card import CARD_KEY, CARD_NAME, PolicyCard
from tendon_newton.data.files.guarded import TooMuch, guarded
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.files.text_file import read_bytes
from tendon_newton.data.files.torchscript_archive import START, read_extra, refuse_damage
from tendon_newton.data.files.trust import may_run, trust_content
from tendon_newton.errors import (
    InvalidPolicyFile,
    MissingDependency,
    TendonNewtonError,
    first_line,
)

Observation = NDArray[np.float32]
FILE_SIZE_LIMIT = 1 << 26  # Bytes; a policy has about 1 << 17
EXTERNAL = re.compile(rb"(?:\x0a|\x8a\x80*\x00)(?:\x08|\x88\x80*\x00)location")
"""How an ONNX file says that weights stand in another file: a protobuf entry with this key, its
numbers in the shortest form or in a longer one."""
ALLOCATION = "Failed to allocate memory"  # Words of onnxruntime where no memory is left
TRIALS = (0.0, 1.0, -1.0, 1.0e3)  # Numbers of which observations are made to try a network


@dataclass(frozen=True, kw_only=True)
class Policy:
    """A policy that was read and checked."""

    path: Path
    sha256: str
    card: PolicyCard
    engine: str  # Engine of the policy: onnxruntime or torch
    run: Callable[[Observation], Any]  # Gives the output of an observation of shape (1, N)

    def __call__(self, observation: Observation) -> tuple[float, ...]:
        """Return the action that the policy wants of each servo [rad], before any cut.

        Raises:
            PolicyFailure: The policy could not be run, or gave something else than an action per
                servo.
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


def load_policy(path: Path, *, trust: bool = False) -> Policy:
    """Read a policy and make sure that it does what its card says.

    Args:
        trust: Whether to trust a TorchScript file from now on: its code runs with the user's
            rights.

    Raises:
        InvalidPolicyFile: The file is damaged, has no card, takes more memory or time than any
            policy, or its network and card disagree.
        MissingDependency: The file needs a package that is not installed.
        UntrustedNetworkFile: The file is TorchScript, and the user has not said to trust it.
    """
    content = read_content(path)
    scripted = content.startswith(START)
    known = scripted and may_run(path, content, trust=trust, instead="an ONNX")
    try:
        if not known:
            guarded(try_content, content)
        card, engine, run = open_content(content)
    except (InvalidPolicyFile, TooMuch) as error:
        raise InvalidPolicyFile(f"{path}: {error}") from error
    if scripted and not known:
        trust_content(content, path.name)
    return Policy(path=path, sha256=content_hash(content), card=card, engine=engine, run=run)


def open_content(content: bytes) -> tuple[PolicyCard, str, Callable[..., Any]]:
    """Return a policy's card, what runs it, and how."""
    if content.startswith(START):
        return torchscript_policy(content)
    metadata, run = onnx_session(content)
    if CARD_KEY not in metadata:
        raise InvalidPolicyFile(
            f"a policy's metadata has the key {CARD_KEY!r} with its card; this file has "
            f"{', '.join(metadata) or 'none'}: was it written by `tendon-newton train-policy`?"
        )
    return PolicyCard.from_json(metadata[CARD_KEY]), "onnxruntime", run


def try_content(content: bytes) -> None:
    """Refuse a network that does not take the card's observations or act on its servos."""
    card, _, run = open_content(content)
    for level in TRIALS:
        try_observation(card, run, level)


def read_content(path: Path) -> bytes:
    """Read a file's bytes; the same bytes are hashed and run."""
    promise = "a policy is an ONNX or TorchScript file"
    return read_bytes(path, InvalidPolicyFile, promise, size_limit=FILE_SIZE_LIMIT)


def onnx_session(content: bytes) -> tuple[Mapping[str, str], Callable[[NDArray[Any]], Any]]:
    """Let onnxruntime read a network: its metadata, and how to run it on the loop's own core."""
    if EXTERNAL.search(content):
        raise InvalidPolicyFile(
            "one file with everything in it; some of its weights stand in another file: export "
            "with external_data=False"
        )
    refuse_operators(content)
    try:
        # large, and only where there is a network; it has no types
        engine: Any = importlib.import_module("onnxruntime")
    except ModuleNotFoundError as error:
        raise MissingDependency(
            "this needs the package 'onnxruntime', which is not installed; "
            "pip install 'tendon-newton[hardware]'"
        ) from error
    options = engine.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    # what was looked at above; it knows another format by its first bytes
    options.add_session_config_entry("session.load_model_format", "ONNX")
    options.log_severity_level = 4  # what is wrong comes as an exception
    try:
        session = engine.InferenceSession(content, options, ["CPUExecutionProvider"])
        metadata = dict(session.get_modelmeta().custom_metadata_map)
    except Exception as error:  # its exceptions have no common base
        raise InvalidPolicyFile(
            f"a network that onnxruntime can run; it says: {first_line(error)}"
        ) from error
    names = [each.name for each in session.get_inputs()]
    if len(names) != 1:
        raise InvalidPolicyFile(f"a network of one input; this one has {len(names)}")

    def run(values: NDArray[Any]) -> Any:
        try:
            return session.run(None, {names[0]: values})[0]
        except Exception as error:  # its exceptions have no common base
            if ALLOCATION in str(error):
                raise MemoryError(first_line(error)) from error
            raise

    return metadata, run


def torchscript_policy(content: bytes) -> tuple[PolicyCard, str, Callable[..., Any]]:
    """Read card and network of a TorchScript file."""
    card = PolicyCard.from_json(read_extra(content, CARD_NAME, "a policy", InvalidPolicyFile))
    refuse_damage(content, InvalidPolicyFile)
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
        except Exception as error:  # its reader of damaged bytes fails in any way
            raise InvalidPolicyFile(
                f"a TorchScript file that torch can read; it says: {first_line(error)}"
            ) from error
    torch.set_num_threads(1)

    def run(observation: Observation) -> Any:
        with torch.inference_mode():
            return module(torch.from_numpy(observation)).numpy()

    return card, "torch", run


def try_observation(card: PolicyCard, run: Callable[..., Any], level: float) -> None:
    """Refuse a network that does not answer to an observation of equal numbers."""
    observation = np.full((1, card.observation_size), level, dtype=np.float32)
    try:
        with np.errstate(all="ignore"):
            output = np.asarray(run(observation))
    except (TendonNewtonError, MemoryError):
        raise
    except Exception as error:  # each engine fails in its own ways
        raise InvalidPolicyFile(
            f"must take observations of {card.observation_size} numbers, as its card says; a test "
            f"call failed: {first_line(error)}"
        ) from error
    servos = card.servo_count
    if output.size != servos or not np.issubdtype(output.dtype, np.floating):
        promise = "one action" if servos == 1 else f"{servos} actions, one for each servo,"
        raise InvalidPolicyFile(
            f"must give {promise} per observation; it gives an array of shape {output.shape}"
        )
    if not np.isfinite(output).all():
        raise InvalidPolicyFile("must give finite actions; a test call gave NaN or infinity")
