"""Find out what a simulation gets wrong about a bench: record, diagnose, choose the next run.

Begins with random steps, diagnoses them, and designs the command that is expected to tell the most
about what is still open: which causes, and what the model predicts of your task. Sets of causes are
carried on from run to run. When the time at the bench is spent, all recordings are diagnosed.

On a virtual bench:
  tendon-newton investigate --port virtual::3 --out bench_3 --faster-than-real-time

On a bench that is plugged in:
  tendon-newton investigate --port /dev/ttyUSB0 --load-cell-port /dev/ttyACM0
  --calibration cell.toml --benches finger --out bench

OUT gets recordings (a dataset), the first and the last diagnosis (as the verb diagnose
writes it), sets (what is left open between), investigation.json (what was tried, why, what it
brought) and investigation.html (the same as a picture). Ctrl-C ends it; the same command takes it
up again.
"""

from tendon_newton.cli.terminal import Terminal
from tendon_newton.workflows.options import InvestigateOptions


def main(config: InvestigateOptions) -> None:
    """Investigate, and say where the answer is."""
    from tendon_newton.cli.duration import read_duration
    from tendon_newton.device_code.quiet import quiet_warp

    budget = read_duration(config.budget, "--budget")
    each = config.diagnosis_budget
    diagnosis_budget = None if each is None else read_duration(each, "--diagnosis-budget")
    quiet_warp()

    from tendon_newton.workflows.investigating.investigation import investigate

    with Terminal() as operator:
        page = investigate(config, operator, budget=budget, diagnosis_budget=diagnosis_budget)
    print(f"\n  the path to it  {page}")
