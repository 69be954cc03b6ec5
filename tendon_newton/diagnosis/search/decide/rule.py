"""The constants that decide whether a cause is named, all of them.

Everything else that the search compares with data follows from the sensors, the bench or the data,
or only says how long it looks. `python -m tests.planted.sets.calibrate` draws the price's curve.
"""

PRICE = 0.1
"""Gain in score [nat per row] that each number of a cause must bring, on all rows and on parts of
the data that no number has seen: residuals a tenth smaller. Models of real servos predict motions
left out best from 0.07 to 0.15, and true planted causes bring 0.24 to 9. A rival that is behind by
less, where little but noise counts, is not told from a cause."""
FORM_THETA, FORM_FORCE = 3.0e-3, 0.1
"""Angle [rad] and force [N] by which a law of dry friction misses real friction on a nominal bench:
bristles of 5 to 40 um give way before anything slides, and it sticks elsewhere. A cause that
changes what is simulated by less gets no name either."""
LADDER = 3.0
"""How much more a law misses than the next plainer one [1]: one that jumps from rest (its breakaway
force is above the sliding one), one that sticks, one that does neither."""
REST = 0.1
"""Weight of a row at rest where something sticks [1]: one error in all rows of a rest. Where
nothing sticks all rows at rest together count at most as much as those in motion."""
LEAST_EXPLAINED = 0.8
"""Share of the squared error above the noise [1] that named causes must explain together; with less
the answer is that something else is the matter."""
