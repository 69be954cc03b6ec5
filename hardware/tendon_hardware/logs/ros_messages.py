"""ROS 2 messages of a session: their definitions, and how each is filled.

The definitions are those of the ROS 2 packages common_interfaces and rcl_interfaces (Apache-2.0),
of the Humble release, which a file needs so that others can read it without them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

Message = dict[str, Any]  # A message as the encoder takes it; it never leaves the writing of a log

RULE = "=" * 80
TIME = f"{RULE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
HEADER = f"{RULE}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{TIME}"
LAYOUT = (
    f"{RULE}\nMSG: std_msgs/MultiArrayLayout\n"
    f"std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n{RULE}\n"
    "MSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n"
)

JOINT_STATE = "sensor_msgs/msg/JointState"
WRENCH = "geometry_msgs/msg/WrenchStamped"
POINT = "geometry_msgs/msg/PointStamped"
INTEGERS = "std_msgs/msg/Int32MultiArray"
NUMBER = "std_msgs/msg/Float64"
NUMBERS = "std_msgs/msg/Float64MultiArray"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"

DEFINITIONS: dict[str, str] = {
    JOINT_STATE: (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
        f"float64[] effort\n{HEADER}"
    ),
    WRENCH: (
        f"std_msgs/Header header\ngeometry_msgs/Wrench wrench\n{HEADER}{RULE}\n"
        "MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"
        f"{RULE}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    ),
    POINT: (
        f"std_msgs/Header header\ngeometry_msgs/Point point\n{HEADER}{RULE}\n"
        "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
    ),
    INTEGERS: f"std_msgs/MultiArrayLayout layout\nint32[] data\n{LAYOUT}",
    NUMBERS: f"std_msgs/MultiArrayLayout layout\nfloat64[] data\n{LAYOUT}",
    NUMBER: "float64 data\n",
    DIAGNOSTICS: (
        f"std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n{HEADER}{RULE}\n"
        "MSG: diagnostic_msgs/DiagnosticStatus\nbyte OK=0\nbyte WARN=1\nbyte ERROR=2\n"
        "byte STALE=3\nbyte level\nstring name\nstring message\nstring hardware_id\n"
        f"diagnostic_msgs/KeyValue[] values\n{RULE}\nMSG: diagnostic_msgs/KeyValue\n"
        "string key\nstring value\n"
    ),
}

LEVELS = {"ok": 0, "warn": 1, "error": 2, "stale": 3}
"""Levels of a diagnostic status, as its definition numbers them."""


def header(stamp: int, frame: str) -> Message:
    """Fill a header; the stamp is in nanoseconds."""
    seconds, nanoseconds = divmod(stamp, 1_000_000_000)
    return {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": frame}


def joint_state(
    stamp: int,
    names: Sequence[str],
    position: Sequence[float],
    velocity: Sequence[float] = (),
    effort: Sequence[float] = (),
) -> Message:
    """Fill a JointState; what is not measured stays empty."""
    return {
        "header": header(stamp, ""),
        "name": names,
        "position": position,
        "velocity": velocity,
        "effort": effort,
    }


def wrench(stamp: int, frame: str, force: float) -> Message:
    """Fill a WrenchStamped with a tension [N] along x."""
    none = {"x": 0.0, "y": 0.0, "z": 0.0}
    return {
        "header": header(stamp, frame),
        "wrench": {"force": {"x": force, "y": 0.0, "z": 0.0}, "torque": none},
    }


def point(stamp: int, frame: str, x: float, y: float, z: float) -> Message:
    """Fill a PointStamped [m]."""
    return {"header": header(stamp, frame), "point": {"x": x, "y": y, "z": z}}


def integers(values: Sequence[int]) -> Message:
    """Fill an Int32MultiArray; unsigned values of 32 bits keep their bits."""
    signed = [(value + 0x80000000) % 0x100000000 - 0x80000000 for value in values]
    return {"layout": {"dim": [], "data_offset": 0}, "data": signed}


def numbers(values: Sequence[float]) -> Message:
    """Fill a Float64MultiArray."""
    return {"layout": {"dim": [], "data_offset": 0}, "data": values}


def status(name: str, level: str, message: str, device: str, values: Mapping[str, Any]) -> Message:
    """Fill one status of a DiagnosticArray."""
    return {
        "level": LEVELS[level],
        "name": name,
        "message": message,
        "hardware_id": device,
        "values": [{"key": key, "value": str(value)} for key, value in values.items()],
    }


def diagnostics(stamp: int, statuses: Sequence[Message]) -> Message:
    """Fill a DiagnosticArray."""
    return {"header": header(stamp, ""), "status": statuses}
