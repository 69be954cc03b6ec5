"""Whether exports tell truly how far they stray, on every packaged bench and with every actuator.

``python -m lab.studies.told_replays`` writes each export of MuJoCo and Newton, takes the error of
the motor angle that its page tells of sines of 0.5, 2 and 8 Hz, and holds beside it what a loop of
a user's own finds around the same files (`tests.exports.loops`). Exit code 1 where one is not true.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.errors import TendonNewtonError
from tendon_newton.mechanisms.asset_library import asset_names
from tests.exports.loops import WAVES, told_and_found
from tests.exports.models import SERVOS, model_for


def main() -> int:
    """Print a row for each bench, servo and way."""
    parser = argparse.ArgumentParser(prog="python -m lab.studies.told_replays", description=__doc__)
    parser.add_argument("--benches", nargs="+", default=asset_names(), choices=asset_names())
    parser.add_argument("--servos", nargs="+", default=SERVOS, choices=SERVOS)
    parser.add_argument("--targets", nargs="+", default=["mujoco", "newton"])
    words = parser.parse_args()
    quiet_warp()
    rows = true = refused = 0
    print(f"motor angle [mrad], told|found: {', '.join(WAVES)}")
    for bench in words.benches:
        for servo in words.servos:
            for target in words.targets:
                start = time.monotonic()
                with tempfile.TemporaryDirectory() as name:
                    try:
                        for way, told in told_and_found(
                            Path(name), target, bench, model_for(bench, servo)
                        ):
                            rows, true = rows + len(told), true + sum(one.true for one in told)
                            shown = "  ".join(one.text for one in told)
                            took = time.monotonic() - start
                            print(f"{bench:17s} {servo:15s} {way:18s} {shown}  ({took:.0f} s)")
                    except TendonNewtonError as error:
                        refused += 1
                        print(f"{bench:17s} {servo:15s} {target:18s} refused: {error}")
                sys.stdout.flush()
    print(f"{true} of {rows} told errors are true; {refused} of the exports are refused in words")
    return true < rows


if __name__ == "__main__":
    sys.exit(main())
