from tendon_newton.actuators import ACTUATORS as ACTUATORS
from tendon_newton.actuators.networks.artifact import load_network as load_network
from tendon_newton.data.dataset import Dataset as Dataset
from tendon_newton.data.dataset import load_dataset as load_dataset
from tendon_newton.data.model_file import Model as Model
from tendon_newton.data.model_file import NamedValues as NamedValues
from tendon_newton.data.model_file import load_model as load_model
from tendon_newton.data.model_file import write_model as write_model
from tendon_newton.data.recording import Recording as Recording
from tendon_newton.diagnosis.accounts.saved import load_diagnosis as load_diagnosis
from tendon_newton.diagnosis.diagnose import diagnose as diagnose
from tendon_newton.diagnosis.diagnosed_bench import open_model as open_model
from tendon_newton.diagnosis.result import Diagnosis as Diagnosis
from tendon_newton.effects import EFFECTS as EFFECTS
from tendon_newton.errors import TendonNewtonError as TendonNewtonError
from tendon_newton.force_networks import FORCE_NETWORKS as FORCE_NETWORKS
from tendon_newton.force_networks import build_network as build_network
from tendon_newton.gradients.differentiable import DifferentiableRollout as DifferentiableRollout
from tendon_newton.gradients.trajectory_gradient import (
    simulate_with_gradients as simulate_with_gradients,
)
from tendon_newton.mechanisms.geometry.mechanism import Mechanism as Mechanism
from tendon_newton.mechanisms.loading import load_mechanism as load_mechanism
from tendon_newton.mechanisms.worlds import build_model as build_model
from tendon_newton.simulation.hosts.control_loop import ControlLoop as ControlLoop
from tendon_newton.simulation.hosts.replay import simulate as simulate
from tendon_newton.simulation.hosts.rollout import Rollout as Rollout
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver as TendonSolver

EXPORTS: dict[str, str]
__version__: str

def source_version() -> str: ...
