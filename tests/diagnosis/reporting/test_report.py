"""The page that a stranger reads is whole, says what was found, and needs nothing else."""

import re
import shlex
from collections import Counter
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import tyro

from tendon_newton.cli.diagnosis.experiment import ExperimentConfig
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.plain_numbers import estimate_text, number, quantity
from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.identifiability import Confounded
from tendon_newton.diagnosis.posterior import FittedSet, Posterior
from tendon_newton.diagnosis.report_words import (
    HARDLY_THERE,
    SENTENCES,
    cause_sentence,
    consequence,
    headline,
)
from tendon_newton.diagnosis.reporting.held_out import HeldOutComparison
from tendon_newton.diagnosis.reporting.report import Origin, write_report
from tendon_newton.diagnosis.reporting.report_causes import cause_rows, rival_rows
from tendon_newton.diagnosis.reporting.report_figures import short
from tendon_newton.diagnosis.reporting.report_tables import percent, regime_rows, regimes
from tendon_newton.diagnosis.result import Diagnosis, Errors, Estimate, Rival, Verdict
from tendon_newton.effects import EFFECTS, find_effect
from tests.diagnosis.made_up import EXAMPLE, VERDICTS, diagnosis, evidence, named
from tests.diagnosis.reporting.browser import LEAST_LETTER, WIDTHS, look_at
from tests.diagnosis.reporting.test_report_finger import motions
from tests.made import recorded

VOID = {"meta", "link", "br", "img", "hr", "input"}


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


@pytest.fixture(scope="module")
def with_force() -> Evidence:
    """Evidence with angle and force."""
    return evidence()


@pytest.fixture(scope="module")
def drawn(with_force: Evidence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the page of each verdict: drawing one takes two seconds."""
    folder = tmp_path_factory.mktemp("pages")
    for verdict in VERDICTS:
        write_report(folder / f"{verdict}.html", diagnosis(verdict), with_force)
    return folder


@pytest.fixture(scope="module")
def pages(drawn: Path) -> dict[str, str]:
    """The text of each page."""
    return {v: (drawn / f"{v}.html").read_text(encoding="utf-8") for v in VERDICTS}


OWN_SET = FittedSet(weight=0.5, causes=(), numbers=(), covariance=np.zeros((0, 0)))
TIED = Confounded(
    first="viscous_friction.coefficient", second="command_delay.delay", correlation=-0.97
)


def doubtful() -> Diagnosis:
    """A diagnosis with two sets, numbers at a bound, open ones, and a pair that goes together."""
    found = diagnosis("partly_explained")
    first, second = found.effects
    at_bound = {n: replace(e, at_bound=True) for n, e in first.parameters.items()}
    flat = {n: replace(e, flat=True) for n, e in second.parameters.items()}
    held, *others = found.candidates
    return replace(
        found,
        effects=(replace(first, parameters=at_bound), replace(second, parameters=flat)),
        confounded=(TIED,),
        candidates=(replace(held, at_bound={"delay": 0.4}), *others),
        posterior=Posterior(sets=(OWN_SET, OWN_SET)),
    )


@pytest.fixture(scope="module")
def doubtful_page(with_force: Evidence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its page, in a folder whose name has a space."""
    path = tmp_path_factory.mktemp("doubtful") / "my data" / "report.html"
    path.parent.mkdir()
    write_report(path, doubtful(), with_force)
    return path


def proposals(page: str) -> list[str]:
    """Return the words of each run that a page proposes."""
    return re.findall(r"<code>tendon-newton experiment (.*?)</code>", unescape(page))


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_gives_a_whole_page(verdict: Verdict, pages: dict[str, str]) -> None:
    """All elements closed, all names unique, nothing loaded, and small enough to mail."""
    text = pages[verdict]
    page = Page(text)
    assert page.open == []
    assert max(page.names.values()) == 1
    outside = [r for r in page.references if not r.startswith(("#", "data:,"))]
    assert outside == []
    assert {r[1:] for r in page.references if r.startswith("#")} <= page.names.keys()
    assert "http" not in text
    assert page.count["script"] == 0
    assert "Something &lt;odd&gt; &amp; unusual." in text
    assert len(text.encode()) < 1_000_000


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_group_of_pictures_is_there(verdict: Verdict, pages: dict[str, str]) -> None:
    """Two windows, trace, spread and errors for both signals, one ranking, and what remains."""
    remaining = 2 if diagnosis(verdict).unexplained.depends_on else 0
    assert Page(pages[verdict]).count["svg"] == 4 + 2 + 2 + 1 + 2 + remaining


def test_a_page_claims_nothing_that_held_out_recordings_do_not_show() -> None:
    """Its lead says so, and a share of -0.2 % is no minus nothing."""
    told = diagnosis("explained")
    assert consequence(replace(told, notes=(HARDLY_THERE,))) == HARDLY_THERE != consequence(told)
    assert (percent(-0.0018), percent(-0.04)) == ("0", "−4")


def test_springs_have_no_finger(pages: dict[str, str]) -> None:
    """A carriage is not drawn."""
    assert motions(pages["explained"]) == {}


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


def test_the_page_says_what_was_found(pages: dict[str, str]) -> None:
    """The cause stands in words, with number, interval and what it cannot be told from."""
    text = pages["partly_explained"]
    assert "Two causes found, and something else remains; not all of them can be told" in text
    assert "The servo loses 0.810 N for every rad/s at which it turns." in text
    assert "The servo acts 22.9 ms late." in text
    assert "<b>actuator lag</b>" in text
    assert "Record steps." in text


def test_the_first_screen_is_a_table_of_causes(pages: dict[str, str]) -> None:
    """A row for each number, before any picture: size and interval in one unit, and the error."""
    first = pages["partly_explained"].partition("<svg")[0]
    rows = [re.sub(r"<[^>]*>|\s+", " ", r) for r in re.findall(r"<tr>.*?</tr>", first, re.DOTALL)]
    assert [" ".join(row.split()) for row in rows[1:3]] == [
        "The servo loses 0.810 N for every rad/s at which it turns. 0.8100 N s/rad "
        "0.8100 to 0.8100 N s/rad 300 mrad, 0.900 N actuator lag",
        "The servo acts 22.9 ms late. 22.900 ms 22.900 to 22.900 ms 300 mrad, 0.900 N",
    ]


def test_the_run_that_the_page_proposes_can_be_asked_for(doubtful_page: Path) -> None:
    """The verb takes the command, a space in the folder too."""
    (words,) = proposals(doubtful_page.read_text(encoding="utf-8"))
    config = tyro.cli(ExperimentConfig, args=shlex.split(words))
    assert config.diagnosis == doubtful_page.parent
    assert config.out.suffix == ".csv"


def test_suspected_causes_and_rivals_have_tables_of_their_own(with_force, tmp_path) -> None:
    """Each suspect with its reason; each rival with its held-out error, in their order."""
    quiet, loud = (
        Errors(force_rmse=size, theta_rmse=size, theta_mae=size) for size in (0.0123, 0.5)
    )
    rivals = rival_rows(
        [
            Rival(name="lag", effects=(), held_out=1.0, errors=quiet, chosen=True),
            Rival(name="stiction", effects=(), held_out=2.0, errors=loud),
        ],
        BenchScale(),
    )
    assert rivals == [
        {"name": "lag", "errors": "12.3 mrad, 0.0123 N", "chosen": True},
        {"name": "stiction", "errors": "500 mrad, 0.500 N", "chosen": False},
    ]
    suspect = replace(named("load_cell_bias", 0.5), reason="It is small.")
    (row,) = cause_rows([suspect], BenchScale())
    assert (row["reason"], row["parameters"][0]["value"]) == ("It is small.", "0.5000 N")


def test_the_page_says_on_what_the_rest_depends(pages: dict[str, str]) -> None:
    """Side and signals where something remains."""
    text = pages["unexplained"]
    assert "It sits on the side of the servo" in text
    assert "It depends on the motor angle, then the time since the start" in text
    assert "learner" not in pages["explained"]


def test_the_page_says_what_the_data_did_not_pin_down(doubtful_page: Path) -> None:
    """Numbers at a bound, open ones and pairs that go together stand where doubts are listed."""
    text = doubtful_page.read_text(encoding="utf-8")
    assert "viscous friction: coefficient ended at the edge of its range" in text
    assert "command delay: delay is open" in text
    assert "correlation of their errors -0.97" in text
    assert doubtful().to_json()["identifiability"] == {
        "at_bound": ["viscous_friction.coefficient"],
        "flat": ["command_delay.delay"],
        "confounded": [TIED.to_json()],
    }


def test_a_candidate_at_its_bound_is_marked(doubtful_page: Path) -> None:
    """In the ranking and in the file, and no other is."""
    text, marked = doubtful_page.read_text(encoding="utf-8"), doubtful()
    assert text.count("(at its bound)") == 1
    assert f"{marked.candidates[0].name.replace('_', ' ')} (at its bound)" in text
    entries = marked.to_json()["candidates"]
    assert entries[0]["at_bound"] == ["delay"]
    assert not any("at_bound" in entry for entry in entries[1:])


def test_a_shaft_has_no_tendon_and_no_newtons(with_force: Evidence, tmp_path: Path) -> None:
    """Labels, errors and causes are those of a torque; data without a README say nothing."""
    scale = BenchScale(is_shaft=True)
    found = diagnosis("partly_explained")
    assert found.unexplained.structure is not None
    rest = replace(found.unexplained.structure, scale=scale)
    shaft = replace(found, scale=scale, unexplained=replace(found.unexplained, structure=rest))
    path = tmp_path / "report.html"
    write_report(path, shaft, with_force, Origin(dataset=tmp_path))
    text = path.read_text(encoding="utf-8")
    assert "synthetic" not in text
    assert "tendon force" not in text
    assert "[N]" not in text
    assert "shaft torque [N m]" in text


def test_each_row_is_in_one_regime_and_its_error_stands_apart(pages: dict[str, str]) -> None:
    """Off, slack, at rest, in motion: an error while a motor is off is that of its own rows."""
    speed = np.array([0.0, 1.0, 1.0, 0.01, 0.0, 2.0])
    force = np.array([4.0, 4.0, 0.01, 4.0, 4.0, 0.0])
    still, on = np.zeros(6), np.array([False, True, True, True, True, True])
    columns = {"command": still, "motor_velocity": speed, "force": force, "enabled": on}
    measured = recorded(0.01 * np.arange(6.0), still, bench="spring_weak", **columns)
    rows = {name: np.flatnonzero(mask).tolist() for name, mask in regimes(measured, 0.02).items()}
    assert rows == {"motor off": [0], "string slack": [2, 5], "at rest": [3, 4], "in motion": [1]}
    pushed = replace(measured, force=force[:, None] - 1.0)
    assert not regimes(pushed, 0.02)["string slack"].any()
    error = np.array([3e-3, 1e-3, 0.0, 0.0, 0.0, 0.0])
    compared = HeldOutComparison(
        recording=measured, theta=np.stack([error, 0.5 * error]), force=np.ones((2, 6))
    )
    found = replace(diagnosis("explained"), noise_force=0.02)
    told = regime_rows(found, [compared], "theta")
    assert told[0] == ("RMS error of the angle, motor off", "3.00 → 1.50 mrad, 17 % of the rows")
    assert told[3] == ("RMS error of the angle, in motion", "1.00 → 0.500 mrad, 17 % of the rows")
    told = regime_rows(found, [compared, replace(compared, force=None)], "force")
    assert told[2] == ("RMS error of the force, at rest", "1.00 → 1.00 N, 33 % of the rows")
    assert regime_rows(found, [replace(compared, force=None)], "force") == []
    assert "RMS error of the angle, at rest" in pages["explained"]
    assert "RMS error of the force, at rest" in pages["explained"]


def test_a_dataset_speaks_for_itself(with_force: Evidence, tmp_path: Path) -> None:
    """The first paragraph of its README is quoted; one set that is open needs no run."""
    path = tmp_path / "report.html"
    found = replace(diagnosis("partly_explained"), posterior=Posterior(sets=(OWN_SET,)))
    write_report(path, found, with_force, Origin(dataset=EXAMPLE))
    text = path.read_text(encoding="utf-8")
    assert "This dataset is synthetic" in text
    assert proposals(text) == []


def test_the_same_diagnosis_gives_the_same_page(with_force, pages, tmp_path) -> None:
    """To the letter: no date, no chance."""
    write_report(tmp_path / "b.html", diagnosis("explained"), with_force)
    assert (tmp_path / "b.html").read_text(encoding="utf-8") == pages["explained"]


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
    assert (low, high) == (
        "The load cell reads 0.500 N too low",
        "The load cell reads 0.500 N too high",
    )
    assert "16 % less than" in cause_sentence(named("joint_stiffness_error", 0.84))
    assert "4.2 times what" in cause_sentence(named("inertia_error", 4.2))


def test_a_sentence_begins_with_its_owner() -> None:
    """What is wrong with a hand's joints is of a servo's finger; what is of all has no owner."""
    owners = {"gain_error": "Servo 2: ", "joint_dry_friction": "The finger of servo 2: "}
    for effect, owner in owners.items():
        cause = named(effect)
        sentence = cause_sentence(replace(cause, name=f"{effect} of servo 2"))
        assert sentence == owner + cause_sentence(cause)


def test_a_sentence_is_no_finer_than_what_is_known() -> None:
    """A friction of 1.887 N between 0 and 4.18 is one of 1.9 N; one well known has three digits."""
    wide = Estimate(value=1.887, ci95=(0.0, 4.18), unit="N")
    cause = named("coulomb_friction")
    sentences = [
        cause_sentence(replace(cause, parameters={"force": estimate}))
        for estimate in (wide, replace(wide, ci95=(1.88, 1.89)))
    ]
    assert "of 1.9 N opposes" in sentences[0]
    assert "of 1.89 N opposes" in sentences[1]


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


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("logs/run_3.csv", "run 3"),
        ("run_3.csv, servo 2", "run 3, servo 2"),
        ("finger_random_steps_10.mcap, servo 0", "finger ran…10, servo 0"),
    ],
)
def test_recordings_of_several_servos_are_told_apart(name: str, label: str) -> None:
    """The bars of a hand's four servos were all called run 3."""
    assert short(name) == label


def test_every_report_fits_a_desk_and_a_phone(browser: str, drawn: Path) -> None:
    """No sideways scrolling, letters that can be read, no request, nothing on the console."""
    views, console = look_at(browser, drawn, [f"{verdict}.html" for verdict in VERDICTS], WIDTHS)
    assert console == []
    assert len(views) == len(VERDICTS) * len(WIDTHS)
    for view in views:
        assert view.needed <= view.width, view
        assert view.letter >= LEAST_LETTER, view
        assert min(view.drawings) > 0.7 * min(view.width, 500), view
        assert view.loaded == [], view
        assert view.height > 2000, view
