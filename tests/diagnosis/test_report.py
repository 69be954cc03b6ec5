"""The page that a stranger reads is whole, says what was found, and needs nothing else."""

import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.dataset import load_dataset
from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.report import Origin, write_report
from tendon_newton.diagnosis.report_words import (
    SENTENCES,
    cause_sentence,
    estimate_text,
    headline,
    number,
    quantity,
)
from tendon_newton.diagnosis.result import (
    CandidateScore,
    Diagnosis,
    Errors,
    Estimate,
    NamedEffect,
    Unexplained,
    Verdict,
)
from tendon_newton.effects import EFFECTS, find_effect
from tendon_newton.errors import InvalidOutput
from tendon_newton.identification.study import Study
from tendon_newton.model_file import Model, NamedValues, load_model
from tendon_newton.recording import Recording

EXAMPLE = Path(__file__).parents[2] / "examples" / "hidden_friction"
SECONDS = 5.0  # [s] of each recording; enough for a window, and short to simulate
COEFFICIENT = 0.810  # [N s/rad] hidden in the example
VOID = {"meta", "link", "br", "img", "hr", "input"}
VERDICTS: tuple[Verdict, ...] = ("no_gap", "explained", "partly_explained", "unexplained")


class Page(HTMLParser):
    """What a browser would find in a page: unclosed elements, names, and what it would load."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.count: Counter[str] = Counter()
        self.names: Counter[str] = Counter()
        self.references: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Remember an element until it is closed."""
        self.handle_startendtag(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Count an element and note where it points."""
        self.count[tag] += 1
        for key, value in attrs:
            if key == "id":
                self.names[value or ""] += 1
            if key in ("src", "href", "xlink:href", "action", "data"):
                self.references.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        """Close the innermost element, which must have this name."""
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag


def beginning(recording: Recording, *, force: bool) -> Recording:
    """Return a recording's first seconds."""
    rows = recording.time <= recording.time[0] + SECONDS
    assert recording.command is not None
    assert recording.force is not None
    return replace(
        recording,
        time=recording.time[rows],
        command=recording.command[rows],
        motor_position=recording.motor_position[rows],
        motor_velocity=recording.motor_velocity[rows],
        force=recording.force[rows] if force else None,
        enabled=recording.enabled[rows],
        tip=None,
    )


def evidence(*, force: bool = True) -> Evidence:
    """Simulate two held-out recordings of the example without and with its friction."""
    dataset, model = load_dataset(EXAMPLE), load_model(EXAMPLE / "model.toml")
    chosen = [beginning(r, force=force) for r in dataset.test if r.bench.startswith("spring")]
    study = Study(chosen, model, ("viscous_friction",), time_step=1e-3)
    (column,) = study.table.columns("viscous_friction")
    return Evidence(baseline={}, extended={column: COEFFICIENT}, test=study, train=study)


@pytest.fixture(scope="module")
def with_force() -> Evidence:
    """Evidence with angle and force."""
    return evidence()


def named(effect: str, value: float | None = None, **changes: object) -> NamedEffect:
    """A cause whose parameters are at their typical size, or the first at ``value``."""
    parameters = {
        p.name: Estimate(value=p.nominal, ci95=(0.98 * p.nominal, 1.02 * p.nominal), unit=p.unit)
        for p in find_effect(effect).parameters
    }
    if value is not None:
        first = next(iter(parameters))
        parameters[first] = replace(parameters[first], value=value, ci95=(value, value))
    cause = NamedEffect(
        name=effect,
        side=find_effect(effect).side,
        parameters=parameters,
        without=Errors(force_rmse=0.9, theta_rmse=0.3, theta_mae=0.2),
    )
    return replace(cause, **changes)  # type: ignore[arg-type]


def diagnosis(verdict: Verdict) -> Diagnosis:
    """A made-up diagnosis of each kind."""
    causes = {
        "explained": (named("viscous_friction", COEFFICIENT),),
        "partly_explained": (
            named(
                "viscous_friction",
                COEFFICIENT,
                indistinguishable_from=("actuator_lag",),
                separating_experiment="Record steps.",
            ),
            named("command_delay", 0.0229),
        ),
    }.get(verdict, ())
    quiet = Errors(force_rmse=0.051, theta_rmse=0.0005, theta_mae=0.0004)
    loud = Errors(force_rmse=0.9, theta_rmse=0.3, theta_mae=0.2)
    effects = tuple(
        NamedValues(name=c.name, values={n: p.value for n, p in c.parameters.items()})
        for c in causes
    )
    rest = ("theta", "t") if verdict in ("partly_explained", "unexplained") else ()
    scores = np.linspace(0.99, -0.3, len(EFFECTS))
    return Diagnosis(
        verdict=verdict,
        wall_time_s=9.7,
        baseline=quiet if verdict == "no_gap" else loud,
        extended=loud if verdict == "unexplained" else quiet,
        noise_force=0.05,
        noise_theta=0.00044,
        explained_fraction=0.97 if causes else 0.0,
        explained_interval=(0.95, 0.98),
        effects=causes,
        candidates=tuple(
            CandidateScore(name=n, score=float(s), values={})
            for n, s in zip(EFFECTS, scores, strict=True)
        ),
        unexplained=Unexplained(fraction=0.03, depends_on=rest),
        model=Model(
            actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}),
            effects=effects,
        ),
        p_value=0.004975,
        notes=("Something <odd> & unusual.",),
    )


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_gives_a_whole_page(
    verdict: Verdict, with_force: Evidence, tmp_path: Path
) -> None:
    """All elements closed, all names unique, nothing loaded, and small enough to mail."""
    path = tmp_path / "report.html"
    write_report(path, diagnosis(verdict), with_force)
    text = path.read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    assert max(page.names.values()) == 1
    outside = [r for r in page.references if not r.startswith(("#", "data:,"))]
    assert outside == []
    assert {r[1:] for r in page.references if r.startswith("#")} <= page.names.keys()
    assert "http" not in text
    assert page.count["script"] == 0
    assert "Something &lt;odd&gt; &amp; unusual." in text
    assert path.stat().st_size < 1_000_000


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_group_of_pictures_is_there(
    verdict: Verdict, with_force: Evidence, tmp_path: Path
) -> None:
    """Two windows, trace, spread and errors for both signals, one ranking, and what remains."""
    path = tmp_path / "report.html"
    found = diagnosis(verdict)
    write_report(path, found, with_force)
    remaining = 2 if found.unexplained.depends_on else 0
    assert Page(path.read_text(encoding="utf-8")).count["svg"] == 4 + 2 + 2 + 1 + 2 + remaining


def test_without_a_load_cell_only_angles_are_drawn(tmp_path: Path) -> None:
    """One window per bench, one trace, one spread, one ranking, one picture of errors."""
    path = tmp_path / "report.html"
    found = diagnosis("explained")
    errors = Errors(force_rmse=None, theta_rmse=0.0005, theta_mae=0.0004)
    blind = replace(found, baseline=errors, extended=errors, noise_force=None)
    write_report(path, blind, evidence(force=False))
    text = path.read_text(encoding="utf-8")
    assert Page(text).count["svg"] == 2 + 1 + 1 + 1 + 1
    assert "tendon force" not in text


def test_the_page_says_what_was_found(with_force: Evidence, tmp_path: Path) -> None:
    """The cause stands in words, with number, interval and what it cannot be told from."""
    path = tmp_path / "report.html"
    write_report(path, diagnosis("partly_explained"), with_force)
    text = path.read_text(encoding="utf-8")
    assert "Two causes found, and something else remains." in text
    assert "The servo loses 0.810 N for every rad/s at which it turns." in text
    assert "The servo acts 22.9 ms late." in text
    assert "<b>actuator lag</b>" in text
    assert "Record steps." in text


def test_a_dataset_speaks_for_itself(with_force: Evidence, tmp_path: Path) -> None:
    """The first paragraph of its README is quoted; without one nothing is claimed."""
    path = tmp_path / "report.html"
    write_report(path, diagnosis("explained"), with_force, Origin(dataset=EXAMPLE))
    assert "This dataset is synthetic" in path.read_text(encoding="utf-8")
    write_report(path, diagnosis("explained"), with_force, Origin(dataset=tmp_path))
    assert "synthetic" not in path.read_text(encoding="utf-8")


def test_the_same_diagnosis_gives_the_same_page(with_force: Evidence, tmp_path: Path) -> None:
    """Byte for byte: no date, no chance."""
    pages = []
    for name in ("a.html", "b.html"):
        write_report(tmp_path / name, diagnosis("explained"), with_force)
        pages.append((tmp_path / name).read_bytes())
    assert pages[0] == pages[1]


def test_a_page_that_cannot_be_written_is_an_error(with_force: Evidence, tmp_path: Path) -> None:
    """The message names the file."""
    with pytest.raises(InvalidOutput, match="report cannot be written"):
        write_report(tmp_path / "none" / "report.html", diagnosis("no_gap"), with_force)


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_effect_can_be_told_in_words(effect: str) -> None:
    """A sentence without places left open, whatever the sign."""
    first = find_effect(effect).parameters[0]
    for value in (first.lower, first.upper):
        assert not re.search(r"[\[\]{}|]", cause_sentence(named(effect, value)))


def test_sentences_are_about_effects_of_the_catalogue() -> None:
    """No sentence outlives its effect."""
    assert SENTENCES.keys() <= EFFECTS.keys()


def test_words_follow_the_sign() -> None:
    """Below and above its null a parameter means the opposite."""
    low, high = (cause_sentence(named("load_cell_bias", value)) for value in (-0.5, 0.5))
    assert (low, high) == ("The load cell reads 0.500 N too low",
                           "The load cell reads 0.500 N too high")  # fmt: skip
    assert "16 % less than" in cause_sentence(named("joint_stiffness_error", 0.84))
    assert "4.2 times what" in cause_sentence(named("inertia_error", 4.2))


def test_numbers_are_written_as_finely_as_they_are_known() -> None:
    """Two digits of the interval's half width; the unit in which the number reads best."""
    estimate = Estimate(value=0.02219, ci95=(0.02162, 0.02275), unit="s")
    assert estimate_text("command_delay", "delay", estimate) == ("22.19 ms", "21.62 to 22.75 ms")
    wide = Estimate(value=812.3, ci95=(700.0, 930.0), unit="N/m")
    assert estimate_text("obstruction", "stiffness", wide) == ("812 N/m", "700 to 930 N/m")
    assert [number(x) for x in (0.0, 1234.5, -0.01234)] == ["0", "1234", "−0.0123"]
    assert quantity(10135.0, "N/m") == "10.1 N/mm"


def test_the_headline_is_the_verdict() -> None:
    """One sentence each."""
    assert headline(diagnosis("explained")) == "One cause accounts for the gap."
    assert headline(diagnosis("no_gap")).startswith("No gap:")
    assert headline(diagnosis("unexplained")).startswith("There is a gap, and no cause")
