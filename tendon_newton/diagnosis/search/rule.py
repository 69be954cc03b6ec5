"""The bars: what a cause must bring to be named.

A cause's worth is counted in these bars, so the `1.0` in `prune` and `account` is just what is
asked here. `python -m lab.exams.calibrate` draws the price's curve.

All other constants of the search say which sets of causes are fitted, on which rows, and how far.
They can change a name too, since a set that was not fitted to its end cannot win. Nearest to the
decision are `FAR`, `CLEAR` and `KEPT` in `prune`, and `FEW_RIVALS` in `decision`.
"""

PRICE = 0.1
"""Gain in score [nat per row] that each number of a cause must bring at most, on all rows and on
parts of the data that no number has seen: residuals a tenth smaller. Models of real servos predict
motions left out best from 0.07 to 0.15, and true planted causes bring 0.24 to 9. A rival that is
behind by less, where little but noise counts, is not told from a cause."""
NATS = 12.0
"""Gain [nat] that all rows together must bring for each number of a cause, where that is less. Rows
that err together tell as much as one."""
SEARCHED = 1.0 / 3.0
"""Share of what laws usually miss below which a search tells sets no more apart [1]."""
FORM_THETA, FORM_FORCE = 3.0e-3, 0.1
"""Angle [rad] and force [N] by which a law of dry friction misses real friction on a nominal bench:
bristles of 5 to 40 um give way before anything slides, and it sticks elsewhere."""
CHANGED = SEARCHED / 2.0
"""Share of that by which a cause must change what is simulated, at least [1]: what changes less may
be a law's own error, though all rows together make it likely. A damping that nobody planted changed
0.26 of `SEARCHED`, planted tilts 0.64 to 0.96."""
LADDER = 3.0
"""How much more a law misses than the next plainer one [1]: one that jumps from rest (its breakaway
force is above the sliding one), one that sticks, one that does neither."""
REST = 0.1
"""Weight of a row at rest where something sticks [1]: all rows of one rest repeat one error. Where
nothing sticks the weight is `SearchWorlds.rest_share`."""
SURE = 3.0
"""Worth of a cause [bars] from which it is sure. Where something is left that no cause explains,
one that is worth fewer prices is suspected and not named. Refits that leave out each part are
needless for a sure cause: the set without it has seen these parts, and its worth on unseen ones is
no smaller."""
LEAST_EXPLAINED = 0.8
"""Share of the squared error above the noise [1] that named causes must explain together; with less
the answer is that something else is the matter."""
