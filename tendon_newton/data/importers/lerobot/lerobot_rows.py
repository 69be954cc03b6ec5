"""Rows of a LeRobotDataset's parquet files, read by pyarrow in a child process."""

import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.guarded import MEMORY, SECONDS, TooMuch, guarded
from tendon_newton.data.importers.lerobot.info import COMMAND, JOINT_LIMIT, STATE
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidRecording, MissingDependency, listed

FRAME = "frame_index"  # Column that a dataset may lack
COLUMNS = ("timestamp", "episode_index", COMMAND, STATE)
SIZE_LIMIT = 1 << 30  # Bytes of all parquet files; the videos lie elsewhere
ROW_LIMIT = 2_000_000  # Rows of a dataset: eleven hours at 50 Hz
UNPACKED = 8  # Memory that the rows may take, in the files' own sizes, beyond what any work may [1]
BYTES_PER_SECOND = 1_000_000
"""Bytes that are surely read in a second of a core; a hundred times as many are usual."""
START = 7  # Time of a core that pyarrow may take to load, beyond what any work may [s]


@dataclass(frozen=True, kw_only=True)
class LeRobotRows:
    """All rows, in the order of the files."""

    time: Array  # [s] since the episode began, shape (T,)
    episode: Array  # Number of the episode, shape (T,)
    command: Array  # Commanded, in the dataset's unit, shape (T, A)
    state: Array  # Measured, in the dataset's unit, shape (T, S)
    frame: Array | None = None  # Number of the row in its episode, shape (T,)


def read_rows(folder: Path) -> LeRobotRows:
    """Read all rows.

    Raises:
        InvalidRecording: There are none, too many, or what there is holds no such columns.
        MissingDependency: pyarrow is not installed.
    """
    paths = sorted((folder / "data").glob("*/*.parquet"))
    if not paths:
        raise InvalidRecording(f"{folder}: rows stand in data/chunk-*/*.parquet; there is none")
    if importlib.util.find_spec("pyarrow") is None:
        raise MissingDependency(
            f"{folder}: parquet files need the package 'pyarrow', which is not installed; "
            "pip install 'tendon-newton[lerobot]'"
        )
    if strangers := [path for path in paths if path.is_symlink() or not path.is_file()]:
        raise InvalidRecording(f"{strangers[0]}: must be a file of the dataset's own; it is none")
    size = sum(path.stat().st_size for path in paths)
    if size > SIZE_LIMIT:
        raise InvalidRecording(
            f"{folder}: all parquet files have at most {SIZE_LIMIT} bytes; they have {size}"
        )
    try:
        time, episode, command, state, frame = guarded(
            unpack,
            [path.resolve() for path in paths],
            memory=MEMORY + UNPACKED * size,
            seconds=SECONDS + START + size // BYTES_PER_SECOND,
        )
    except TooMuch as error:
        raise InvalidRecording(f"{folder}: must hold parquet files; reading them {error}") from (
            error
        )
    frames = None if np.isnan(frame).any() else frame
    return LeRobotRows(time=time, episode=episode, command=command, state=state, frame=frames)


def unpack(paths: list[Path]) -> tuple[Array, ...]:
    """Read the columns of all files, one below the other; the child's part."""
    parts = [unpack_one(path) for path in paths]
    widths = {(part[2].shape[1], part[3].shape[1]) for part in parts}
    if len(widths) > 1:
        raise InvalidRecording(
            f"{paths[0].parent}: all files must have rows of one length; they have "
            f"{listed(str(width) for width in sorted(widths))}"
        )
    if sum(part[0].size for part in parts) > ROW_LIMIT:
        raise InvalidRecording(f"{paths[0].parent}: a dataset has at most {ROW_LIMIT} rows")
    return tuple(np.concatenate(column) for column in zip(*parts, strict=True))


def unpack_one(path: Path) -> tuple[Array, ...]:
    """Read the columns of a file; frames that it has not are no numbers."""
    arrow: Any = importlib.import_module("pyarrow")  # without types
    parquet: Any = importlib.import_module("pyarrow.parquet")

    try:
        file = parquet.ParquetFile(path)
        rows: int = file.metadata.num_rows
        missing = set(COLUMNS) - set(file.schema_arrow.names)
        if missing:
            raise InvalidRecording(
                f"{path}: columns {listed(sorted(missing))} are missing; there are "
                f"{listed(file.schema_arrow.names)}"
            )
        if rows > ROW_LIMIT:
            raise InvalidRecording(f"{path}: a dataset has at most {ROW_LIMIT} rows; it has {rows}")
        refuse_long_lists(path, file.metadata)
        framed = FRAME in file.schema_arrow.names
        table = file.read(columns=[*COLUMNS, *[FRAME] * framed], use_threads=False)
        return (
            numbers_of(path, table, COLUMNS[0]),
            numbers_of(path, table, COLUMNS[1]),
            lists_of(path, table, COMMAND),
            lists_of(path, table, STATE),
            numbers_of(path, table, FRAME) if framed else np.full(rows, np.nan),
        )
    except MemoryError:  # which pyarrow's own is as well
        raise
    except (arrow.ArrowException, OSError, ValueError, TypeError, KeyError) as error:
        raise InvalidRecording(
            f"{path}: must be a parquet file that pyarrow can read; it says "
            f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        ) from error


def refuse_long_lists(path: Path, metadata: Any) -> None:
    """Refuse rows that say themselves that they hold more numbers than there are joints."""
    for group in range(metadata.num_row_groups):
        rows = metadata.row_group(group)
        for place in range(rows.num_columns):
            if rows.column(place).num_values > JOINT_LIMIT * rows.num_rows:
                raise InvalidRecording(
                    f"{path}: a row has lists of at most {JOINT_LIMIT} numbers; "
                    f"{rows.column(place).path_in_schema} has more"
                )


def numbers_of(path: Path, table: Any, key: str) -> Array:
    """Return a column of one number per row, shape (T,)."""
    values = np.asarray(table.column(key).to_numpy(), dtype=np.float64)
    return finite(path, key, values.reshape(-1))


def lists_of(path: Path, table: Any, key: str) -> Array:
    """Return a column of one list per row, shape (T, N)."""
    column = table.column(key).combine_chunks()
    values = np.asarray(column.flatten().to_numpy(zero_copy_only=False), dtype=np.float64)
    rows = len(column)
    if not rows:
        raise InvalidRecording(f"{path}: a LeRobotDataset has rows; this file has none")
    if column.null_count or values.size % rows:
        raise InvalidRecording(f"{path}: {key} must be a list of as many numbers in every row")
    width = values.size // rows
    lengths = np.unique(np.diff(column.offsets.to_numpy())) if hasattr(column, "offsets") else ()
    if not 0 < width <= JOINT_LIMIT or len(lengths) > 1:
        raise InvalidRecording(
            f"{path}: {key} must be a list of 1 to {JOINT_LIMIT} numbers, as many in every row"
        )
    return values.reshape(rows, width)


def finite(path: Path, key: str, values: Array) -> Array:
    """Refuse what is no number."""
    if not np.isfinite(values).all():
        row = int(np.argwhere(~np.isfinite(values))[0][0])
        raise InvalidRecording(f"{path}: {key} must be finite; row {row} is not")
    return values
