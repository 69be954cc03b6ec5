"""Options of what drives a bench, each declared once; verbs show them. Files of named policies."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from tendon_newton.data.cards.policy_observation import SERVO_RATE
from tendon_newton.data.files.text_file import absence
from tendon_newton.errors import InvalidPolicyFile, listed
from tendon_newton.mechanisms.asset_library import asset_folder


@dataclass(frozen=True, kw_only=True)
class LoadCellOptions:
    """Where the load cell of a bench is."""

    load_cell_port: str | None = None
    """Serial port of the load cell; a virtual bench brings its own."""
    calibration: Path | None = None
    """Calibration of the load cell; without one only raw counts are kept, and no tension."""
    faster_than_real_time: bool = False  # Whether a virtual bench runs as fast as it can.


@dataclass(frozen=True, kw_only=True)
class BenchPorts(LoadCellOptions):
    """Where a bench is plugged in, if there is one."""

    port: str | None = None
    """Serial port of the servos, or virtual, or virtual:finger:3 for unit 3, or
    virtual:finger:3:friction (or :spool, :planted) for that unit worn."""
    further_load_cell_ports: tuple[str, ...] = ()
    """Serial ports of the load cells in the tendons of further servos."""
    further_calibrations: tuple[Path, ...] = ()  # Calibrations of those load cells.


@dataclass(frozen=True, kw_only=True)
class BenchOptions(LoadCellOptions):
    """What stands on a bench, how often it is read, and how far it may go."""

    load_cell: str = "hx711_serial"  # Kind of the load cell.
    load_cell_rate: int = 20
    """Readings per second of the load cell: 20 as on the paper's bench, 80 or 10 [Hz]."""
    servo: str = "xc330_t288_t"  # Kind of the servo; a policy's card must name the same.
    servo_id: int = 1  # ID of the servo on its bus.
    baud: int = 1_000_000  # Rate of the bus [1/s].
    retries: int | None = None
    """How often an instruction to the servo is sent again, 4 ms each; 2 unless given."""
    rate: float = SERVO_RATE
    """Readings of the servo per second [Hz]; a policy's card must name the same."""
    force_limit: float = 30.0
    """Tension at which the motor is switched off, or with a policy the tendon let out [N]."""
    temperature_limit: float = 65.0  # Temperature at which the same is done [degC].
    notes: str = ""  # What is to be remembered with the recordings.


@dataclass(frozen=True, kw_only=True)
class CollectOptions(BenchOptions):
    """What to record, where the bench is, and where the dataset goes."""

    port: str
    """Serial port of the servo, or virtual, or virtual::3 for unit 3 of the virtual benches."""
    out: Path  # Folder of the dataset; recordings are added to it.
    plan: str | None = None
    """Plan to record: paper (36 min), quick (1 min), board (7 min); without one, a single run."""
    bench: str = "finger"
    """Bench of a single run: finger, spring_weak, spring_strong, or your own finger's asset in a
    folder of TENDON_NEWTON_ASSETS, which also takes the finger's place in a plan."""
    excitation: str = "random_steps"
    """Command of a single run, such as random_steps, sine, ramps or steps_held_2s."""
    duration: float = 60.0  # Length of a single run [s].
    split: Literal["train", "test"] = "train"  # Split of a single run.
    obstacle: str = "free"
    """What blocks the finger in a single run: free, tape_roll, hand or hand_perturbation."""
    command_rate: float | None = None  # Commands per second [Hz]; 20 unless given.
    spool_radius: float | None = None  # Radius of the spool [m]; unless given the asset's.
    seed: int = 0  # Seed of what the excitations draw.


@dataclass(frozen=True, kw_only=True)
class DeployOptions(BenchOptions, BenchPorts):
    """Which policy, where the bench is, and how far it may go."""

    policy: Path | None = None
    """ONNX file of the policy with its card inside, or TorchScript where torch is installed; or
    finger-stairs or hand-turning, which come along."""
    spool_radius: float = 0.0125  # Radius of the spool [m]; a policy's card must name the same.
    goals: str = "keyboard"
    """Where goals come from: keyboard, stdin, stairs, a file of times [s] and angles
    [rad], or one angle [rad]. A policy that turns a ball takes rates [rad/s]."""
    duration: float | None = None
    """Length [s]; by default that of stairs or of a file of goals, else a key ends the run."""
    out: Path = Path("deployments")  # Folder for the log; it becomes a dataset.
    split: Literal["train", "test"] = "train"  # Split of the log in that dataset.
    dry_run: bool = False  # Read and decide, but leave the motor off.
    jog: bool = False
    """Move the spool by hand with the arrow keys, without a policy; home is where it stands."""
    replay: Path | None = None
    """Log whose observations are given to the policy again, to compare its actions."""
    trust: bool = False  # Trust this TorchScript policy from now on; it is a program.
    force_network: Path | None = None
    """ONNX file of a force network that estimates the tension where no load cell is."""
    camera_port: str | None = None
    """Port on which a camera's program tells where a ball is; a virtual hand brings its own."""
    bench: str | None = None
    """Bench under assets; unless given that of the policy's training, or the virtual one that the
    port names, or finger."""
    further_servo_ids: tuple[int, ...] = ()
    """IDs of further servos, in the order of the asset's tendons; unless given the next ones."""
    policy_rate: float = 20.0  # Policy steps per second [Hz]; the policy's card must name the same.


@dataclass(frozen=True, kw_only=True)
class ClimbOptions(BenchPorts):
    """Let policies follow stairs of goals, in simulation and on a bench, and compare them."""

    policies: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Policy files, ONNX or TorchScript; finger-stairs and hand-turning name those that come
    along."""
    out: Path  # Folder for the results; made if it is not there.
    force: tuple[str, ...] = ("ideal",)
    """What pulls the simulated finger: ideal, model files (.toml), known servos or force networks
    (.safetensors)."""
    finger: str | None = None
    """Finger of the policies: a name under assets/, a USD file or an asset's folder; unless given
    the one on their cards."""
    worlds: int = 1  # Simulated fingers; all but the first have numbers of their own.
    randomise: tuple[str, ...] = ("joint_friction", "link_mass", "spool_radius", "joint_spring")
    """What differs between them; see train-policy. With joint_friction the first one has the
    nominal friction, a tenth of the springs' torque; none takes the model as it is."""
    dwell: float = 1.5  # Time on each stair in simulation [s]; on a bench it is 1.5 s.
    rate: float = 1.0  # Rate that policies which turn a ball are asked for [rad/s].
    seconds: float = 60.0  # Time for which they turn it [s].
    device: Literal["cpu", "cuda"] = "cpu"  # Where their worlds are simulated; all of these differ.
    seed: int = 0  # Seed of the numbers of the further worlds.
    trust: bool = False
    """Trust the TorchScript files from now on: they are programs and run with your rights."""
    logs: tuple[Path, ...] = ()
    """Logs of deployments on stairs, to be compared too; the first policy's bench is assumed."""
    plots: bool = True  # Whether to draw the figure.


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
