"""The command line: one verb per file, found without importing the others."""

import atexit
import gc
import importlib
import os
import sys
from collections.abc import Generator, Sequence
from contextlib import contextmanager, nullcontext, redirect_stdout
from pathlib import Path
from typing import Any, get_type_hints

from tendon_newton.data.files.output_folder import releasing
from tendon_newton.errors import (
    InvalidParameter,
    InvalidPlugIn,
    MissingDependency,
    TendonNewtonError,
    unknown_name,
)

VERBS: dict[str, str] = {
    "demo": "tendon_newton.cli.demo",
    "import": "tendon_newton.cli.import_",
    "simulate": "tendon_newton.cli.simulate",
    "diagnose": "tendon_newton.cli.diagnosis.diagnose",
    "explain": "tendon_newton.cli.diagnosis.explain",
    "oscillation": "tendon_newton.cli.diagnosis.oscillation",
    "wear": "tendon_newton.cli.diagnosis.wear_of_logs",
    "experiment": "tendon_newton.cli.diagnosis.experiment",
    "asset": "tendon_newton.cli.asset",
    "servo": "tendon_newton.cli.known_servo",
    "export": "tendon_newton.cli.export",
    "train-force": "tendon_newton.cli.training.train_force",
    "train-policy": "tendon_newton.cli.training.train_policy",
    "evaluate-policy": "tendon_newton.cli.training.evaluate_policy",
    "doctor": "tendon_newton.cli.bench.doctor",
    "calibrate": "tendon_newton.cli.bench.calibrate",
    "collect": "tendon_newton.cli.bench.collect",
    "deploy": "tendon_newton.cli.bench.deploy",
    "plot": "tendon_newton.cli.plot",
    "virtual-bench": "tendon_newton.cli.bench.virtual_bench",
}
"""Our own verbs and their modules; `every_verb` has those of installed plug-ins too."""

VERBOSE_OPTION, VERBOSE_SHORT = "--verbose", "-v"
VERBOSE_WORDS = "with any verb: also prints what the libraries beneath say of themselves"
QUIET_OPTION = "--quiet"
QUIET_WORDS = "with any verb: prints errors and warnings alone; the exit code tells the rest"

COLLECT_AFTER = (50_000, 50)
"""New objects after which Python looks for dead ones among them that refer to each other, and how
often it does so before it looks among older ones too. With its own 700 and 10 a start looks through
all that torch and Newton have loaded up to ten times."""

# exit codes of the shell's conventions: 2 misuse, 128 + 2 interrupted, 128 + 13 broken pipe
EXIT_MISUSE = 2
EXIT_INTERRUPTED = 130
EXIT_BROKEN_PIPE = 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit code; an error is one line and no traceback."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if (closed := closed_stream()) is not None:
        print(f"error: {closed} must be open, if on /dev/null; it is closed", file=sys.stderr)
        return EXIT_MISUSE
    try:
        code = dispatch(words)
        sys.stdout.flush()  # here, where a closed pipe is still ours to handle
        return code
    except (TendonNewtonError, OSError) as error:
        if isinstance(error, BrokenPipeError):
            # else Python complains again when it flushes at exit
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return EXIT_BROKEN_PIPE
        print(f"error: {one_line(words_of(error))}", file=sys.stderr)
        return EXIT_MISUSE
    except SystemExit as request:  # help and misuse of options, which tyro has explained
        return request.code if isinstance(request.code, int) else EXIT_MISUSE
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED


def words_of(error: TendonNewtonError | OSError) -> str:
    """Return what an error says; the system's own comes with the file and without its number."""
    if not isinstance(error, OSError) or error.strerror is None:
        return str(error)
    return f"{error.filename or 'what is written or read'}: {error.strerror}"


def closed_stream() -> str | None:
    """Return the standard stream that is closed, if any.

    The next file that is opened would take its number, and what is read or printed by that.
    """
    streams = {"input": sys.stdin, "output": sys.stdout, "error": sys.stderr}
    closed = [f"the standard {name}" for name, stream in streams.items() if stream is None]
    return closed[0] if closed else None


def one_line(message: str) -> str:
    """Return a message on one line, with what would steer a terminal made visible."""
    words = " ".join(message.split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in words)


def dispatch(words: list[str]) -> int:
    """Run the verb that the first word names."""
    if not words or words[0] in ("-h", "--help"):
        print(overview())
        return 0 if words else EXIT_MISUSE
    if words[0] == "--version":
        from tendon_newton import __version__

        print(__version__)
        return 0
    verbs = VERBS if words[0] in VERBS else every_verb()
    if words[0] not in verbs:
        raise unknown_name("verb", words[0], verbs)
    return run_verb(words[0], verbs[words[0]], words[1:])


def every_verb() -> dict[str, str]:
    """Return the module of each verb by name: our own, and those of installed plug-ins."""
    from tendon_newton.plug_ins import VERBS as GROUP
    from tendon_newton.plug_ins import added

    return VERBS | {name: entry.value for name, entry in added(GROUP, VERBS).items()}


def config_of(path: str) -> Any:
    """Return the class, or the classes, that a verb's words are read into.

    Args:
        path: Module of the verb.

    Raises:
        InvalidPlugIn: Module of a plug-in that cannot be imported, or has no ``main``.
    """
    try:
        return get_type_hints(importlib.import_module(path).main)["config"]
    except Exception as error:
        if path in VERBS.values():
            raise
        raise InvalidPlugIn(
            f"{path} must be a module with main(config: Config), as the plug-in promises; it ends "
            f"with {type(error).__name__}: {error}"
        ) from error


def run_verb(verb: str, path: str, words: list[str]) -> int:
    """Build a verb's config from the words and run it."""
    # before numpy is imported: where other programs are busy, its threads wait for each other, and
    # matrices as small as ours take a hundred times as long
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(*COLLECT_AFTER)
    atexit.register(gc.freeze)  # an end would look through all of it twice more: 2 s
    import tyro

    refuse_words(words)
    if VERBOSE_OPTION in words or VERBOSE_SHORT in words:
        os.environ["TENDON_NEWTON_VERBOSE"] = "1"  # the processes that a verb starts read it too
        words = [word for word in words if word not in (VERBOSE_OPTION, VERBOSE_SHORT)]
    quiet = QUIET_OPTION in words
    words = [word for word in words if word != QUIET_OPTION]
    config_type = config_of(path)
    module: Any = importlib.import_module(path)
    config = tyro.cli(
        config_type,
        args=words,
        config=(tyro.conf.PositionalMetavarFromFieldName, tyro.conf.DisallowNone),
        prog=f"tendon-newton {verb}",
        description=f"{module.__doc__}\n{VERBOSE_SHORT}, {VERBOSE_OPTION} {VERBOSE_WORDS}.\n"
        f"{QUIET_OPTION} {QUIET_WORDS}.",
    )
    try:
        with releasing(), silence() if quiet else nullcontext():
            module.main(config)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("tendon_newton"):
            raise
        raise MissingDependency(
            f"{verb} needs the package {error.name!r}, which is not installed; "
            "pip install 'tendon-newton[sim]' has everything but training"
        ) from error
    return 0


def refuse_words(words: Sequence[str]) -> None:
    """Refuse words that no file, folder or note can have."""
    for before, word in zip(["", *words], words, strict=False):
        if not word.isascii() and any("\udc80" <= letter <= "\udcff" for letter in word):
            raise InvalidParameter(f"words and names must be UTF-8; {word!a} is not: rename it")
        if (before == "--out" and not word) or word == "--out=":
            raise InvalidParameter("--out must name a folder, '.' for this one; it is empty")


@contextmanager
def silence() -> Generator[None]:
    """Let nothing that is printed come out; what is written to the error stream does."""
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
        yield


def overview() -> str:
    """List the verbs with the first line of what each says of itself."""
    verbs = every_verb()
    width = max(map(len, verbs))
    lines = [f"  {verb:{width}}  {summary(path)}" for verb, path in verbs.items()]
    return "\n".join(
        [
            "usage: tendon-newton VERB ...   (tendon-newton VERB --help for its options)",
            "",
            *lines,
            "",
            "  --version  print the version",
            f"  {VERBOSE_SHORT}, {VERBOSE_OPTION}  {VERBOSE_WORDS}",
            f"  {QUIET_OPTION}  {QUIET_WORDS}",
        ]
    )


def summary(path: str) -> str:
    """First line of a verb's docstring, or why a plug-in's cannot be used."""
    try:
        config_of(path)
    except InvalidPlugIn as error:
        return f"cannot be used: {one_line(str(error))}"
    return (importlib.import_module(path).__doc__ or "").strip().split("\n")[0]
