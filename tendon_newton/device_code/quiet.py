"""What Warp says of itself while it starts and compiles, in fewer words of ours."""

import logging
import os
import sys
from tempfile import TemporaryFile

# Environment variable under which nothing is kept back; the option --verbose of every verb
VERBOSE = "TENDON_NEWTON_VERBOSE"
# Words of native code where there is no GPU; who asks for one is told by a verb
NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"


class CompilingShown(logging.Handler):
    """Shows what compiles, on the error stream where the output is for programs."""

    def __init__(self, *, on_errors: bool) -> None:
        super().__init__()
        self.on_errors = on_errors

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line."""
        stream = sys.stderr if self.on_errors else sys.stdout
        stream.write(f"  {self.format(record)}\n")
        stream.flush()


def quiet_warp(*, on_errors: bool = False) -> None:
    """Start Warp without its news; errors, and other words of native code, are passed on.

    What compiles may go to the error stream.
    """
    import warp as wp

    from tendon_newton.device_code.kernel_loading import LOG, written_cache

    LOG.handlers = [CompilingShown(on_errors=on_errors)]
    LOG.setLevel(logging.INFO)
    if os.environ.get(VERBOSE):
        with written_cache():
            wp.init()
        return
    wp.config.log_level = wp.LOG_ERROR
    sys.stderr.flush()
    terminal = os.dup(2)
    with TemporaryFile() as said:
        os.dup2(said.fileno(), 2)
        try:
            with written_cache():
                wp.init()
        finally:
            os.dup2(terminal, 2)
            os.close(terminal)
            said.seek(0)
            for line in said:
                if NO_DRIVER not in line:
                    os.write(2, line)
