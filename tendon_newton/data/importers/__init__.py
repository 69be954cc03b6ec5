"""Readers of other people's log formats; one file each, one line in the table."""

from collections.abc import Callable
from pathlib import Path

from tendon_newton.data.importers.imported import Imported
from tendon_newton.data.importers.lerobot import read_lerobot
from tendon_newton.errors import unknown_name

IMPORTERS: dict[str, Callable[[Path], Imported]] = {"lerobot": read_lerobot}
"""Our own readers by format; installed packages may add more (`tendon_newton.plug_ins`)."""
MAPPED = "mapped"  # The format of logs that a mapping file describes


def find_importer(name: str) -> Callable[[Path], object]:
    """Return the reader of a format, ours or a plug-in's; an unknown name is refused.

    It gives an `Imported`; a plug-in's may break that.
    """
    from tendon_newton import plug_ins

    if name in IMPORTERS:
        return IMPORTERS[name]
    known = (*IMPORTERS, MAPPED)
    entries = plug_ins.added(plug_ins.IMPORTERS, known)
    if name not in entries:
        raise unknown_name("log format", name, (*known, *entries))
    return plug_ins.load(entries[name])
