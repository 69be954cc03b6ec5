"""Studies of policies do what is missing, in the order of its worth, and count what failed."""

import json
import time
from pathlib import Path

import pytest

from lab.studies.climbs import file_of
from lab.studies.diagnosed_policies import PACKAGED, jobs_of, reader, row_of, study_of, tuned
from lab.studies.job_graph import Job, Places, failures, left, run
from lab.studies.turning_hands import compared, deploy, policies_of
from tendon_newton.data.files.origin import content_hash
from tendon_newton.errors import TendonNewtonError
from tests.diagnosis.in_time.test_changes import log_of
from tests.physics.runs import ideal_model


def make(path: Path, text: str) -> str:
    """Write a file, or fail where the text says so."""
    if text == "fail":
        raise ValueError(text)
    path.write_text(text)
    return text


def chain(out: Path, *texts: str) -> list[Job]:
    """Return jobs each of which reads what the one before it makes; the last is wanted."""
    files = [out / str(k) for k in range(len(texts))]
    return [
        Job(makes=file, needs=tuple(files[max(0, k - 1) : k]), work=make, what=(file, text),
            wanted=k == len(texts) - 1, brief=k > 0)
        for k, (file, text) in enumerate(zip(files, texts, strict=True))
    ]  # fmt: skip


def places(seconds: float = 60.0) -> Places:
    """Return one core, for some time from now."""
    return Places(devices=("cpu",), each=1, cores=1, until=time.monotonic() + seconds)


def test_jobs_wait_for_what_they_read_and_are_done_once(tmp_path: Path) -> None:
    """In any order of the list; what is there is not made again, nor what nobody wants."""
    jobs = chain(tmp_path, "a", "b", "c")
    run(jobs[::-1], places(), tmp_path, lambda: None)
    said = [json.loads(line)["said"] for line in (tmp_path / "jobs.jsonl").read_text().splitlines()]
    assert said == ["a", "b", "c"]
    (tmp_path / "0").unlink()
    assert left(jobs) == []
    (tmp_path / "2").unlink()
    assert [job.makes.name for job in left(jobs)] == ["2"]


def test_a_job_that_fails_ends_no_other(tmp_path: Path) -> None:
    """What needs it is not begun; the failure is kept."""
    (tmp_path / "x").mkdir()
    run([*chain(tmp_path, "fail", "b"), *chain(tmp_path / "x", "c")], places(), tmp_path, list)
    assert (tmp_path / "x" / "0").read_text() == "c"
    assert not (tmp_path / "1").exists()
    (told,) = failures(tmp_path)
    assert "ValueError('fail')" in told


def test_brief_jobs_alone_begin_when_the_time_is_over(tmp_path: Path) -> None:
    """A climb of a policy that is there is made; nothing is trained."""
    jobs = chain(tmp_path, "a", "b")
    run(jobs, places(-1.0), tmp_path, list)
    assert not (tmp_path / "0").exists()
    (tmp_path / "0").touch()
    run(jobs, places(-1.0), tmp_path, list)
    assert (tmp_path / "1").read_text() == "b"


@pytest.fixture
def study(tmp_path: Path):
    """Return a study of two units with two seeds."""
    words = ["--out", str(tmp_path), "--units", "8", "9", "--seeds", "0", "1"]
    return study_of(reader("").parse_args([*words, "--arms", "ideal", "diagnosed"]))


def test_only_what_an_arm_needs_is_done(study) -> None:
    """No network for a diagnosis; all policies climb on both units; all of a seed first."""
    jobs = left(jobs_of(study, 1))
    names = [job.makes.parent.name for job in jobs if job.on_device]
    assert names == [
        "ideal-0", "diagnosed_8-0", "diagnosed_9-0", "ideal-1", "diagnosed_8-1", "diagnosed_9-1"
    ]  # fmt: skip
    assert sum(job.brief for job in jobs) == 2 * (2 + 4) + 2
    assert not any("long" in str(job.makes) for job in jobs)
    for _, _, what in study.all_climbs:
        file_of(*what).touch()
    assert left(jobs_of(study, 1)) == []


def test_policies_that_do_no_better_than_a_still_finger_have_failed() -> None:
    """Arms are paired by unit, over the seeds of both; the packaged policy has one for all."""
    errors = {
        "ideal": {"8": {0: 20.0, 1: 24.0}, "9": {0: 18.0, 1: 30.0}},
        "network": {"8": {0: 10.0}, "9": {0: 9.0, 1: 11.0}},
        PACKAGED: {"8": {0: 6.0}, "9": {0: 6.0}},
    }
    ideal, network, packaged = (row_of(arm, errors, "ideal", 25.0) for arm in errors)
    assert (ideal["climbs"], ideal["failed"]) == (4, 1)
    assert network["share"] == pytest.approx((10.0 + 10.0) / (20.0 + 24.0))
    assert packaged["share"] == pytest.approx(6.0 / 23.0)


def test_tuning_finds_the_numbers_of_a_model_from_a_log() -> None:
    """Friction and slack of another unit than the model's, to 5 %; what fits stays as it is."""
    truth = ideal_model(coulomb_friction={"force": 1.1}, tendon_slack={"length": 0.003})
    start = ideal_model(coulomb_friction={"force": 0.6}, tendon_slack={"length": 0.001})
    model = tuned([log_of(truth, 4)], start)
    found = {effect.name: effect.values for effect in model.effects}
    assert found["coulomb_friction"]["force"] == pytest.approx(1.1, rel=0.05)
    assert found["tendon_slack"]["length"] == pytest.approx(0.003, rel=0.05)
    assert model.actuator == start.actuator


def test_a_difference_of_one_hand_or_one_seed_counts_for_nothing(rng) -> None:
    """Ten seeds agree on a hand that gains 30 rad/min, and yet another hand may gain nothing."""
    first = 20.0 + rng.normal(0.0, 3.0, (10, 10))
    everywhere, one = first - 4.0 + rng.normal(0.0, 1.0, (2, 10, 10))
    one += 4.0
    one[:, 3] -= 30.0
    assert compared(first, everywhere).endswith(": significant")
    assert compared(first, one).endswith(": no difference that counts")
    assert compared(first.T, one.T).endswith(": no difference that counts")


def test_a_policy_turns_each_hand_once(tmp_path: Path) -> None:
    """Rows of the same policy stay; another one in its place is deployed, and is none here."""
    (tmp_path / "seed_31.onnx").write_bytes(b"a policy")
    ((seed, policy),) = policies_of(tmp_path).items()
    asked = {"rate_rad_per_s": 1.5, "seconds": 20.0}
    rows = {**asked, "policy": content_hash(b"a policy"), "hands": [{"unit": 7}]}
    results = tmp_path / "hands.json"
    results.write_text(json.dumps({f"sheet{seed}": rows}))
    deploy("sheet_31", policy, [7], asked, results)
    policy.write_bytes(b"another")
    with pytest.raises(TendonNewtonError):
        deploy("sheet_31", policy, [7], asked, results)
