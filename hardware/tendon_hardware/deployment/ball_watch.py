"""Where the ball in a hand is while a policy turns it, and what happens when it leaves its cup."""

from collections import deque
from math import atan2, dist

import numpy as np

from tendon_hardware.benches.bench import Bench
from tendon_hardware.cameras.line_camera import Camera, Place, Sighting
from tendon_hardware.control.operator import Operator
from tendon_hardware.errors import BallNotSeen
from tendon_hardware.logs.session_log import SessionLog
from tendon_newton.data.cards.turning_task import TurningTask, half_turn

FIRST_LOOK = 1.0
"""Time in which a camera looks at the ball in its cup before a run [s]: its noise averages out."""
FRAMES_MIN = 10  # Sightings that this takes
BLIND = 0.4
"""Age of a frame beyond which the ball is nowhere to be seen [s]: nine frames at 30 Hz, and 0.1 s
on the way."""
STEPS = 11  # Steps between frames among which the noise is looked for [1]: as long at 30 Hz
CALM = 0.25
"""Noise of those steps that is too small, of that in the first look [1]: once in 1e9 by chance."""
COARSE = 4.0  # Noise below which it is a matter of single steps [1]
NORMAL = 1.4826  # Standard deviation of a normal scatter, of its median's size [1]
AGREEING = 2  # Sightings in a row that say the same before the ball counts as lost
OPENING = 2.0  # Time that fingers have to open before a virtual ball is put back [s]
SETTLED = 0.5  # Time that a ball must lie in its cup before the policy goes on [s]


class BallWatch:
    """What is known of the ball in each tick.

    Raises:
        BallNotSeen: The bench has no camera.
    """

    def __init__(self, bench: Bench, task: TurningTask, operator: Operator) -> None:
        if bench.camera is None:
            raise BallNotSeen(
                "a policy that turns a ball needs a camera that sees the ball; --camera-port "
                "names the port on which its program sends lines"
            )
        self._bench, self._operator = bench, operator
        self._camera: Camera = bench.camera
        self._distance, self._axis = task.drop_distance, np.array(task.axis)
        self._start: Place = (0.0, 0.0, 0.0)
        self._noise = 0.0
        self._told: deque[Place] = deque(maxlen=STEPS + 1)
        self._seen: deque[Sighting] = deque(maxlen=AGREEING)
        self._since: float | None = None
        self._inside = 0.0
        self._put_back = False
        self.turned = 0.0  # Turn about the task's axis that was seen in the cup [rad]
        self.drops = 0  # Times that the ball has left its cup

    @property
    def place(self) -> Place:
        """Where the ball was seen last, from where it was at first, in the base's axes [m]."""
        return self._away(self._seen[-1])

    @property
    def lost(self) -> bool:
        """Whether the ball is out of its cup, or not yet back for long enough."""
        return self._since is not None

    @property
    def _calm(self) -> bool:
        """Whether the latest places scatter less than a living camera's would."""
        steps = np.diff(np.array(self._told), axis=0)
        full = len(self._told) == STEPS + 1
        return full and float(np.sqrt(np.mean(steps**2))) < CALM * self._noise

    def open(self) -> None:
        """Look at the ball in its cup for a while.

        Raises:
            BallNotSeen: The camera does not see the ball.
        """
        clock = self._bench.clock
        self._camera.open()
        clock.sleep_until(clock.now() + FIRST_LOOK)
        seen = [each for each in self._camera.drain() if clock.now() - each.exposed < FIRST_LOOK]
        if len(seen) < FRAMES_MIN:
            raise BallNotSeen(
                f"the camera must see the ball in its cup {FRAMES_MIN} times in "
                f"{FIRST_LOOK:g} s before a run; it saw the ball {len(seen)} times"
            )
        places = np.array([sighting.place for sighting in seen])
        steps = np.abs(np.diff(places, axis=0))
        noise = NORMAL * float(np.median(steps))  # which leaves a ball out that still rolls
        # one that rounds its places may well tell the same one for a while
        rounded = noise < COARSE * float(np.min(steps[steps > 0.0], initial=np.inf))
        self._noise = 0.0 if rounded else noise
        x, y, z = np.mean(places, axis=0).tolist()
        self._start = (x, y, z)
        self._seen.append(seen[-1])

    def close(self) -> None:
        """Stop to look."""
        self._camera.close()

    def take(self, log: SessionLog | None) -> None:
        """Take in what the camera has told since the last tick."""
        now = self._bench.clock.now()
        for sighting in self._camera.drain():
            self._told.append(sighting.place)
            frozen = self._noise > 0.0 and sighting.place == self._seen[-1].place
            if not frozen and now - sighting.exposed <= BLIND:
                if self._since is None:
                    before, after = np.array([self._seen[-1].turn, sighting.turn])
                    self.turned += 2.0 * atan2(*half_turn(before, after, self._axis))
                self._seen.append(sighting)
            if log is not None:
                log.ball(sighting.exposed, sighting.arrived, self._away(sighting), self.turned)
        if now - self._seen[-1].exposed > BLIND:
            self._lose(now, "The camera does not see the ball: put it back, or look at the camera.")
        elif self._calm:
            self._lose(now, "The camera tells one place with less noise than before: look at it.")
        elif all(map(self._outside, self._seen)):
            self._lose(now, "The ball has left its cup: put it back between open fingers.")
        elif self._since is not None and now - self._inside > SETTLED:
            self._since = None
            self._operator.tell("The ball is back in its cup: the policy goes on.")
        self._help(now)

    def _away(self, sighting: Sighting) -> Place:
        """Return where the ball was from where it was at first [m]."""
        (x, y, z), (x0, y0, z0) = sighting.place, self._start
        return x - x0, y - y0, z - z0

    def _outside(self, sighting: Sighting) -> bool:
        return dist(sighting.place, self._start) > self._distance

    def _lose(self, now: float, told: str) -> None:
        """Note that the ball is out of its cup now, or might be, and tell the operator."""
        self._inside = now
        if self._since is None:
            self._since = now
            self._put_back = False
            self.drops += 1
            self._operator.tell(told)

    def _help(self, now: float) -> None:
        """Put the ball of a virtual bench back once the fingers have had time to open."""
        controls = self._bench.controls
        waited = self._since is not None and now - self._since > OPENING
        if controls is not None and waited and not self._put_back:
            self._put_back = True
            controls.put_ball_back()
