"""What a reader should see in each group of a report's pictures."""

from collections.abc import Mapping

from tendon_newton.diagnosis.reporting.held_out import WINDOW
from tendon_newton.diagnosis.result import Diagnosis
from tendon_newton.diagnosis.unexplained.remainder import side_words
from tendon_newton.diagnosis.unexplained.remainder_structure import SURROGATES

SIGNAL_WORDS = {
    "theta": "the motor angle",
    "theta_dot": "the motor's speed",
    "theta_d": "the command",
    "force": "the tendon force",
    "t": "the time since the start",
    "time_since_reversal": "the time since the motion turned round",
    "theta_d_change": "how the command has just changed",
    "force_change": "how the force has just changed",
    "temperature": "the temperature",
    "voltage": "the supply voltage",
}

NEAR_NOISE = 1.5  # An error of up to so many noise floors is called noise
LEAST_P = 1.5 / SURROGATES  # Below, the chance is too small to be counted with so many surrogates
RESIDUALS = (
    "Measured minus simulated. A model that lacks nothing leaves only noise: a line within the "
    "grey band, and in the lower pictures a hill within the grey area at the left."
)
ERRORS = (
    "Root mean square over each recording, simulated from its commands alone. Shorter is better; "
    "the dotted line, the noise of the sensors, is the best that any model can do."
)
EXTENDED = (
    "The extended model is model.toml beside this page; the next simulation or diagnosis can start "
    "from it."
)
UNCHANGED = (
    "Nothing was added: model.toml beside this page is the model that was given, with its unknown "
    "numbers, if any, fitted."
)
RANKING = (
    "Each effect of the catalogue was added alone to the starting model. The bar is the share of "
    "the squared error above the noise that it removes from the recordings it was fitted to; for "
    "effects that were not followed, a survey estimates it. The verb explain says what became of "
    "each."
)


def captions(diagnosis: Diagnosis) -> Mapping[str, str]:
    """Return the texts of all groups."""
    return {
        "windows_caption": windows_caption(diagnosis),
        "residual_caption": RESIDUALS,
        "errors_caption": ERRORS,
        "ranking_caption": ranking_caption(diagnosis),
        "remainder_caption": remainder_caption(diagnosis),
        "model_caption": EXTENDED if diagnosis.effects else UNCHANGED,
    }


def windows_caption(diagnosis: Diagnosis) -> str:
    """Say which seconds are shown and where the lines should lie."""
    gap = diagnosis.verdict != "no_gap"
    choice = "where the starting model errs most" if gap else "in which most moves"
    text = f"For each bench the {WINDOW:g} seconds of a held-out recording {choice}. "
    if diagnosis.actuator is not None:
        text += "In all pictures the starting model has the actuator that was found already. "
    if diagnosis.effects:
        return text + (
            "The dashed line is the starting model; the solid one, with what was named, should "
            "lie on the broad grey line of the measurement."
        )
    if gap:
        return text + "Where the dashed line leaves the broad grey one, the model is wrong."
    return text + "The dashed line should lie on the broad grey line of the measurement."


def near_noise(diagnosis: Diagnosis) -> bool:
    """Tell whether the held-out errors of the extended model are about as large as the noise."""
    after = diagnosis.extended
    signals = ("theta", "force", *after.others_rmse)
    pairs = ((after.of(signal), diagnosis.noise_of(signal)) for signal in signals)
    return all(
        error <= NEAR_NOISE * floor
        for error, floor in pairs
        if error is not None and floor is not None
    )


def ranking_caption(diagnosis: Diagnosis) -> str:
    """Say what the ranking means."""
    if diagnosis.verdict == "no_gap":
        return (
            f"{RANKING} There is next to nothing to remove here, so these are shares of noise: "
            "none was named."
        )
    if not diagnosis.effects:
        return (
            f"{RANKING} None was named: even the best leaves more than noise, so at most it "
            "imitates the cause."
        )
    text = f"{RANKING} Named causes are in colour."
    if any(effect.indistinguishable_from for effect in diagnosis.effects):
        return f"{text} A bracket joins causes that this data cannot tell apart."
    return f"{text} Another with a long bar imitates the cause, but does clearly worse."


def remainder_caption(diagnosis: Diagnosis) -> str:
    """Say whether the rest is noise, and what it follows."""
    return f"{remainder_sentence(diagnosis)} {structure_sentence(diagnosis)}".strip()


def remainder_sentence(diagnosis: Diagnosis) -> str:
    """Say how much remains."""
    if diagnosis.verdict == "no_gap":
        return (
            "Noise: the error of the starting model is as large as that of the sensors, and none "
            "of the causes that were tried takes a piece of it away."
        )
    if diagnosis.verdict == "explained" and near_noise(diagnosis):
        return "Noise: with what was named, the error on unseen data is what the sensors leave."
    fraction = diagnosis.unexplained.fraction
    percent = "less than 1" if 0.0 < fraction < 0.01 else f"{100.0 * fraction:.0f}"
    share = f"Of the held-out squared error above the noise {percent} % remains."
    if diagnosis.verdict == "explained":
        return f"{share} That is no more than the simple laws of dry friction miss on any bench."
    return share


def structure_sentence(diagnosis: Diagnosis) -> str:
    """Say what a flexible learner makes of the rest."""
    structure = diagnosis.unexplained.structure
    if structure is None:
        return ""
    if not structure.found:
        return (
            "It is more than noise, but a flexible learner cannot predict it from the recorded "
            "signals: it depends on something that was not recorded, on chance, or on a longer "
            "past. See when it occurs, above."
        )
    what, _ = side_words(structure.side, structure.scale)
    words = [SIGNAL_WORDS.get(name, name) for name in structure.depends_on]
    order = ", the strongest first" if len(words) > 1 else ""
    first = (
        f"It sits on the side of the {structure.side}: seen there, a"
        if structure.side != "whole"
        else "A"
    )
    return (
        f"{first} flexible learner predicts {100.0 * structure.held_out_r2:.0f} % of it (the "
        f"{what}) on recordings held out (chance of that with noise of the same colour: "
        f"p {'=' if structure.p_value > LEAST_P else '≤'} {structure.p_value:.2g}). It depends on "
        f"{', then '.join(words)}{order}. Dots are means of what was measured, with "
        "95 % intervals; the line is what was learned. Noise alone would give dots at zero."
    )
