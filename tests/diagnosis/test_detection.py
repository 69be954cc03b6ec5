"""Chance is judged by noise of the residual's own colour."""

from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy import signal

from tendon_newton.diagnosis.detection import SURROGATES, surrogates
from tendon_newton.identification.objective import Layout

ROWS = 800


def test_surrogates_have_the_spectrum_of_each_recording_and_no_memory_of_its_rows() -> None:
    """Amplitudes stay to rounding, phases do not: a record is like another one as noise is."""
    rng = np.random.default_rng(0)
    colours = (0.9, 0.0)
    parts = [signal.lfilter([1.0], [1.0, -c], rng.standard_normal(ROWS)) for c in colours]
    where = Layout(
        recording=np.repeat([0, 1], ROWS),
        block=np.arange(2 * ROWS) // 80,
        is_force=np.zeros(2 * ROWS, dtype=bool),
        block_count=20,
    )
    search: Any = SimpleNamespace(where=where)
    made = surrogates(search, np.concatenate(parts), rng)
    assert made.shape == (SURROGATES, 2 * ROWS)
    for place, part in enumerate(parts):
        own = made[:, place * ROWS : (place + 1) * ROWS]
        # a real signal has no phase at its least and greatest frequency
        amplitude = np.abs(np.fft.rfft(own, axis=1))[:, 1:-1]
        expected = np.abs(np.fft.rfft(part))[1:-1]
        np.testing.assert_allclose(amplitude, np.tile(expected, (SURROGATES, 1)), rtol=1e-6)
        alike = own @ part / (np.linalg.norm(own, axis=1) * np.linalg.norm(part))
        assert np.max(np.abs(alike)) < 0.9
        assert abs(np.mean(alike)) < 0.1  # 200 draws of a share that is 0.2 at most
