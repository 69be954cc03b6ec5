"""Bring a finger's motion to a target by gradients through a force network and the mechanism.

A recording that asks for two steps is simulated with an untrained Transformer as the servo. Adam
then moves the network's weights, the commands and the viscous friction until the motor angle
follows the target. Run from the root of the repository::

    python examples/gradients/tune_a_servo.py
"""

import sys

import numpy as np
import torch
import warp as wp

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.force_networks import build_network
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.gradients.network_course import TapedNetwork
from tendon_newton.gradients.trajectory_gradient import simulate_with_gradients
from tendon_newton.mechanisms.loading import load_mechanism

wp.config.log_level = wp.LOG_ERROR
torch.manual_seed(0)
network = build_network("transformer", of_set="paper", window=30).double().eval()
network.force_mean.fill_(4.0)

time = np.arange(81) / 80.0
command = np.where(time < 0.5, 1.0, 2.0)[:, None]
recording = Recording(
    name="steps",
    bench="finger",
    time=time,
    command=command,
    motor_position=np.zeros((81, 1)),
    motor_velocity=np.zeros((81, 1)),
)
model = Model(
    actuator=NamedValues(name="learned", values={"spool_radius": 0.0125}),
    effects=(NamedValues(name="viscous_friction", values={"coefficient": 0.1}),),
)
rollout = DifferentiableRollout(
    load_mechanism("finger"),
    [recording],
    model,
    network=TapedNetwork(module=network, window=30, rate=20.0),
    time_step=1.0e-3,
)
target = torch.tensor(0.8 + 0.2 * np.sin(2.0 * np.pi * time))[:, None]
parameters = torch.tensor(rollout.inputs.parameters.numpy(), requires_grad=True)
commands = torch.tensor(command, requires_grad=True)
optimiser = torch.optim.Adam(
    [
        {"params": [commands], "lr": 0.1},
        {"params": [parameters], "lr": 0.01},
        {"params": rollout.weights, "lr": 0.01},
    ]
)
for step in range(31):
    optimiser.zero_grad()
    out = simulate_with_gradients(rollout, parameters=parameters, command=commands)
    loss = (out.motor_position - target).square().mean().sqrt()
    loss.backward()
    if step % 10 == 0:
        sys.stdout.write(f"step {step:2d}: the motor angle is {1e3 * loss.item():6.1f} mrad off\n")
    optimiser.step()
