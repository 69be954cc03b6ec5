"""What a written program knows of its model; each has its own numbers in place of these."""

import math
from pathlib import Path
from typing import Any

FOLDER = Path()  # Where the program lies, and the files beside it
PARAMETERS = [0.0]  # Numbers of actuator and effects, then two zeros
SERVO_ROWS: list[dict[str, Any]] = []  # What is known of each servo and its tendon
JOINT_ROWS: list[dict[str, Any]] = []  # What is known of each joint
SPAN = (0.0, 0.0)  # Motor angles [rad] between which the program's own commands move
PERIOD = 1.0  # Seconds that pass in one second of the log's clock [1]
NETWORK: dict[str, Any] | None = None  # File, rate [Hz] and window of a force network
TIME_STEP = math.inf  # Longest step [s]
MEMORY_SIZE = 1  # How many numbers are remembered of a tendon or joint
COMMAND_DELAY = 0.0  # Delay of the command [s], where the program has it in place of the law
RIGID = False  # Whether the string of a rotor does not stretch in the model
