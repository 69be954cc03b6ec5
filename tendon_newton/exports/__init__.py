"""Identified models carried into other programs: one file a target, one line each in the table.

An export writes files, a page that says how to load them, how far what was written strays from our
own simulation of the same commands, and what it leaves out.
"""

from tendon_newton import plug_ins
from tendon_newton.errors import InvalidPlugIn, unknown_name
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.mujoco.mujoco_target import MUJOCO
from tendon_newton.exports.newton.newton_target import NEWTON
from tendon_newton.exports.usd_target import USD

EXPORTS: dict[str, ExportTarget] = {"mujoco": MUJOCO, "newton": NEWTON, "usd": USD}


def find_export(name: str) -> ExportTarget:
    """Return a target, ours or a plug-in's; an unknown name is refused."""
    if name in EXPORTS:
        return EXPORTS[name]
    added = plug_ins.added(plug_ins.EXPORTS, EXPORTS)
    if name not in added:
        raise unknown_name("export target", name, (*EXPORTS, *added))
    target = plug_ins.load(added[name])
    if not isinstance(target, ExportTarget):
        raise InvalidPlugIn(f"{name}: {added[name].value} must be an ExportTarget; it is none")
    return target


__all__ = ["EXPORTS", "ExportTarget", "Exported", "find_export"]
