"""Rows of anybody's CSV and JSON files, and numbers in them."""

import csv
import json
import re
from array import array
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence, Sized
from datetime import UTC, datetime, time
from itertools import chain, islice
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.files.text_file import LOG_SIZE_LIMIT, finite_number, open_text, read_text
from tendon_newton.data.files.values import are_tables, is_list, is_table
from tendon_newton.data.formats.mapped_column import ANGLE, UNITS, MappedColumn
from tendon_newton.data.importers.column_mapping import ColumnMapping
from tendon_newton.data.importers.csv_dialect import COMMENTS, PROMISE, CsvDialect
from tendon_newton.data.recording import Array
from tendon_newton.data.stamps import step_fault
from tendon_newton.errors import InvalidRecording, listed, shown

STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
"""One step of a path into a row: a key, or the place in a list."""
LINES = (".jsonl", ".ndjson")  # Suffixes of files with one JSON object per line
JSON_SIZE_LIMIT = 1 << 25  # Bytes of a JSON log, whose rows take twenty times as much in memory
Row = Mapping[str, Any]
BEYOND = "cells beyond the header's"
PLACE = "line"
"""Column of the lines, or of the rows of a JSON file, in which the rows stand."""


EPOCH = datetime(2020, 1, 1, tzinfo=UTC)
"""Instant from which dates are counted: a log's own steps keep their digits."""
DAY = 86400.0  # [s]
LONGEST_NIGHT = 60.0  # Step over midnight [s] beyond which a clock has rather begun again
IN_BRACKETS = re.compile(r"[\[(][^\[\]()]+[\])]$")
"""The unit at the end of a column's name, as in `angle [deg]`."""
TURN = 2.0 * np.pi  # [rad]
REPEATED = 0.3  # Share of the rows [1] with the stamp before, of several servos in one file
SERVOS = 50  # Most servos of one file
REACH = 3.0  # Widths of a Gaussian beyond which its weights are none [1]
MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "inf", "+inf", "-inf"})
"""Cells that say that there is no number."""
HELD = ("theta_d", "enabled", "voltage", "temperature")
"""Columns that stay as they are until told anew: many a logger writes them where they change."""
SILENT = 3.0  # Periods of a load cell after which nothing is known of the force [1]
SWITCHED = {"true": 1.0, "on": 1.0, "yes": 1.0, "false": 0.0, "off": 0.0, "no": 0.0}
"""Words for a motor that is on, or off."""
MINUTES = re.compile(r"(\d{1,2}):([0-5]\d\.\d+)")
"""Minutes and seconds, as a spreadsheet writes a short time."""


def read_mapped_columns(
    path: Path, mapping: ColumnMapping, name: str
) -> tuple[dict[str, Array], list[Finding]]:
    """Read the columns that a mapping names, in our units, shape (T,) each.

    Rows in which one of them has no number are left out, but for those that `HELD` names.
    """
    wanted = {ours: column for ours, column in mapping.columns.items() if column.source is not None}
    numbers = {ours: array("d") for ours in wanted}
    staying = [ours for ours in wanted if re.sub(r"_\d+$", "", ours) in HELD]
    last: dict[str, float | None] = dict.fromkeys(staying)
    cell_rate = mapping.stated_of(path.name).load_cell_rate
    slow = [ours for ours in wanted if cell_rate and ours.startswith("force")]
    empty: Counter[str] = Counter()
    filled: Counter[str] = Counter()
    places = array("d")
    rows, dialect = read_rows(path, mapping)
    told = [*guessed(name, dialect.text(mapping.dialect))]
    rows, units = without_units(iter(rows), wanted)
    told += units_told(name, wanted, units)
    count, lines = 0, array("d")
    for count, (line, row) in enumerate(rows, start=1):
        if count == 1:
            refuse_absent(path, row, [column.source or "" for column in wanted.values()])
        if any(map(str.strip, beyond := row.get(BEYOND, ()))):
            raise InvalidRecording(
                f"{path}: line {line} has {len(row) - 1 + len(beyond)} cells, and the header "
                f"{len(row) - 1}: name every column; numbers with decimal commas stand in quotes "
                "where commas separate cells"
            )
        found = {
            ours: number_of(path, line, row, ours, column, commas=dialect.decimal == ",")
            for ours, column in wanted.items()
        }
        for ours in staying:
            if found[ours] is None and last[ours] is not None:
                found[ours] = last[ours]
                filled[wanted[ours].source or ""] += 1
            last[ours] = found[ours]
        for ours in slow:
            if found[ours] is None:
                found[ours] = np.nan
                filled[wanted[ours].source or ""] += 1
        absent = [wanted[ours].source or "" for ours, value in found.items() if value is None]
        empty.update(absent)
        if not absent:
            places.append(count - 1)
            lines.append(line)
            for ours, value in found.items():
                numbers[ours].append(value or 0.0)
    silent = [wanted[ours].source or "" for ours in slow if np.isnan(numbers[ours]).all()]
    if len(places) < 2 or silent:
        absent, empty = count if silent else count - len(places), Counter([*empty, *silent])
        lacking = f", {absent} of them lack {listed(empty)}" if empty else ""
        raise InvalidRecording(f"{path}: a log has two rows or more; it has {count}{lacking}")
    columns = {
        ours: column.scale * np.frombuffer(numbers[ours]) + column.offset
        for ours, column in wanted.items()
    }
    refuse_far_offsets(path, wanted, columns)
    if "t" in wanted and (fault := step_fault(columns["t"], wanted["t"].scale)) is not None:
        raise InvalidRecording(f"{path}: {fault}")
    columns[PLACE] = np.frombuffer(lines)
    if "t" not in columns:
        assert mapping.rate is not None
        columns["t"] = np.frombuffer(places) / mapping.rate
    if len(places) == count:
        refuse_servos_in_rows(path, read_rows(path, mapping)[0], mapping, columns["t"])
    columns["t"], nights = past_midnight(columns["t"])
    if nights:
        told.append(
            Examined(name, "t").note(
                f"midnights that pass: {nights}", "a time of day: a day is added behind each"
            )
        )
    for ours in slow:
        columns = between_readings(columns, ours, SILENT / (cell_rate or 1.0))
    if mapping.resample is not None:
        columns = resampled(columns, mapping.resample, path)
    return columns, [*told, *left_out(name, empty, filled, places, count)]


def between_readings(columns: Mapping[str, Array], ours: str, longest: float) -> dict[str, Array]:
    """Return columns with the readings of a slow load cell joined by lines.

    Args:
        ours: Its column, with NaN between readings.
        longest: Time [s] without a reading of which the rows are left out.
    """
    time, rows = columns["t"], np.arange(len(columns["t"]))
    read = np.flatnonzero(np.isfinite(columns[ours]))
    before = read[np.maximum(np.searchsorted(read, rows, side="right") - 1, 0)]
    after = read[np.minimum(np.searchsorted(read, rows), read.size - 1)]
    heard = np.maximum(time[after], time) - np.minimum(time[before], time) <= longest
    joined = {**columns, ours: np.interp(rows, read, columns[ours][read])}
    return {name: values[heard] for name, values in joined.items()}


def refuse_far_offsets(
    path: Path, wanted: Mapping[str, MappedColumn], columns: Mapping[str, Array]
) -> None:
    """Refuse an offset that leads an angle some turns away from where it was: it is in degrees."""
    for ours, column in wanted.items():
        far, offset = float(np.median(np.abs(columns[ours]))), column.offset
        angle = UNITS[re.sub(r"_\d+$", "", ours)] is ANGLE
        if angle and abs(offset) > TURN < far > np.median(np.abs(columns[ours] - offset)):
            raise InvalidRecording(
                f"{path}: {ours} has offset = {offset:g}, which leads it to {far:.4g} rad: an "
                f"offset is in our unit, and {offset:g} deg are offset = {np.deg2rad(offset):.4g}"
            )


def refuse_servos_in_rows(
    path: Path, rows: Iterable[tuple[int, Row]], mapping: ColumnMapping, time: Array
) -> None:
    """Refuse a file with a row for each servo, whose number is in a column."""
    if time.size < 2 or np.mean(np.diff(time) == 0.0) < REPEATED:
        return
    mapped = {column.source for column in mapping.columns.values()}
    table = [row for _, row in islice(rows, time.size)]
    for name in table[0]:
        words = [str(row.get(name)) for row in table]
        kinds = dict.fromkeys(words)
        if name in mapped or not 1 < len(kinds) <= SERVOS or len(words) != time.size:
            continue
        if len({*zip(time, words, strict=True)}) == time.size:
            raise InvalidRecording(
                f"{path}: has a row for each servo, and {shown(name)} says which "
                f"({listed(kinds)}): write one file a servo, or a column for each"
            )


def without_units(
    rows: Iterator[tuple[int, Row]], wanted: Mapping[str, MappedColumn]
) -> tuple[Iterator[tuple[int, Row]], list[str]]:
    """Return rows without a first one that holds the columns' units, and these."""
    first = next(rows, None)
    if first is None:
        return rows, []
    cells = [cell(first[1], column.source or "") for column in wanted.values()]
    words = [c.strip() for c in cells if isinstance(c, str) and not is_missing(c)]
    worded = [w for w in words if number_in(w.replace(",", ".")) is None and seconds_of(w) is None]
    if len(worded) == len(cells) > 1 and not any(isinstance(list_in(w), list) for w in worded):
        return rows, worded
    return chain([first], rows), []


def units_told(
    name: str, wanted: Mapping[str, MappedColumn], units: Sequence[str]
) -> Iterator[Finding]:
    """Tell of a row of units, and of columns whose own unit the mapping does not say."""
    if units:
        yield Examined(name, "all").note(
            f"a row of units below the header: {listed(units)}",
            "passed over; say unit in the mapping where it is another than ours",
        )
    for k, (ours, column) in enumerate(wanted.items()):
        beside = IN_BRACKETS.search(column.source or "")
        unit = (units[k] if units else beside[0] if beside else "").strip("[]() ")
        sizes = UNITS[re.sub(r"_\d+$", "", ours)]
        stated = np.isclose(abs(column.scale), list(sizes.values()), rtol=1e-9, atol=0.0)
        own = np.isclose(sizes.get(unit, np.nan), list(sizes.values()), rtol=1e-9, atol=0.0)
        if own.any() and stated.any() and not (own & stated).any():
            yield Examined(name, ours).defect(
                f"its unit is {unit!r} by the file", f'say unit = "{unit}" for it in the mapping'
            )


def past_midnight(time: Array) -> tuple[Array, int]:
    """Return times of a day [s] that go on behind midnight, shape (T,), and how often they do."""
    steps = np.diff(time)
    night = (steps < 0.0) & (steps > -DAY) & (steps + DAY < LONGEST_NIGHT)
    if not night.any() or time.min() < 0.0 or time.max() > DAY:
        return time, 0
    return time + DAY * np.concatenate([[0], np.cumsum(night)]), int(night.sum())


def resampled(columns: Mapping[str, Array], rate: float, path: Path) -> dict[str, Array]:
    """Return fewer rows, each the mean of those around its instant, shape (T',) for (T,).

    The weights are Gaussian, and fall off by half an interval of the new rows; what falls between
    the steps of an encoder then shows.

    Args:
        rate: New rows per second [Hz].
    """
    time = columns["t"]
    step = float(np.median(np.diff(time)))
    if not 0.0 < step < 1.0 / rate:
        raise InvalidRecording(
            f"{path}: resample makes fewer rows; {rate:g} Hz is asked for, and the median step is "
            f"{step:g} s"
        )
    width = 0.5 / (rate * step)
    reach = np.arange(-round(REACH * width), round(REACH * width) + 1)
    weights = np.exp(-0.5 * (reach / width) ** 2)
    stride = round(1.0 / (rate * step))
    if len(time) <= len(weights) + stride:
        raise InvalidRecording(f"{path}: resample needs more rows; there are {len(time)}")
    weights /= weights.sum()
    spans = {ours: sliding_window_view(x, len(weights))[::stride] for ours, x in columns.items()}
    return {ours: np.asarray(rows @ weights, dtype=np.float64) for ours, rows in spans.items()}


def guessed(name: str, words: str) -> Iterator[Finding]:
    """Say what was guessed of a file."""
    if words:
        yield Examined(name, "all").note(
            f"{words}, by its first lines",
            "seen, not stated; delimiter and decimal in the mapping say otherwise",
        )


def left_out(
    name: str, empty: Counter[str], filled: Counter[str], places: Sized, count: int
) -> Iterator[Finding]:
    """Say how many rows lack a number, in which columns, and where the last one was held."""
    for source, times in filled.items():
        yield Examined(name, "all").note(
            f"{source}: {times} of {count} cells are empty",
            "there the last number is held, as of a command that stays until the next; readings "
            "of a load cell whose load_cell_rate is stated are joined by lines",
        )
    if empty:
        cells = ", ".join(f"{column} {times}" for column, times in empty.items())
        yield Examined(name, "all").caution(
            f"{count - len(places)} of {count} rows ({cells} empty cells)",
            "rows without a number in a mapped column are left out; a column that is "
            "often empty is better not mapped, and of a slow load cell say load_cell_rate",
        )


def read_rows(path: Path, mapping: ColumnMapping) -> tuple[Iterable[tuple[int, Row]], CsvDialect]:
    """Read the rows of a file one by one with their places, by the suffix of its name."""
    if path.suffix in (".json", *LINES):
        return json_rows(path, mapping.rows), CsvDialect(delimiter=",", decimal=".")
    sources = [column.source for column in mapping.columns.values() if column.source is not None]
    wanted = {*sources, *(source.split("[", 1)[0] for source in sources)}  # paths into a cell
    dialect = mapping.dialect.guessed(path, wanted)
    return csv_rows(path, dialect, wanted), dialect


def csv_rows(path: Path, dialect: CsvDialect, wanted: Collection[str]) -> Iterator[tuple[int, Row]]:
    """Read lines and rows of a CSV file, of which no wanted column may be there twice."""
    line = 0

    def counted(lines: Iterable[str]) -> Iterator[str]:
        nonlocal line
        for text in lines:
            line += 1
            yield text

    with open_text(path, InvalidRecording, PROMISE, size_limit=LOG_SIZE_LIMIT) as file:
        try:
            reader = csv.DictReader(
                dialect.rows(counted(file)),
                skipinitialspace=True,
                restkey=BEYOND,
                delimiter=dialect.delimiter or ",",
            )
            if reader.fieldnames is not None:
                reader.fieldnames = names = [name.strip() for name in reader.fieldnames]
                if twice := [name for name in wanted if names.count(name) > 1]:
                    raise InvalidRecording(
                        f"{path}: {names.count(twice[0])} columns are named {shown(twice[0])}: "
                        "give each a name of its own"
                    )
            yield from ((line, row) for row in reader)
        except csv.Error as error:
            raise InvalidRecording(f"{path}: a log must be CSV: {error}") from error


def json_rows(path: Path, key: str | None) -> Iterable[tuple[int, Row]]:
    """Read rows and their places: a list of objects or an object of lists, maybe below a key."""
    text = read_text(path, InvalidRecording, "a log is a JSON file", size_limit=JSON_SIZE_LIMIT)
    if path.suffix in LINES:
        parts = [(k, part) for k, part in enumerate(text.split("\n"), start=1) if part.strip()]
        content: Any = [json_part(path, k, part) for k, part in parts]
    else:
        parts, content = [], json_part(path, 1, text)
    table = is_table(content)
    rows = content if key is None else content.get(key) if table else None
    if is_table(rows) and (columns := lists_of(rows)):
        lengths = {name: len(values) for name, values in columns.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise InvalidRecording(f"{path}: columns must be equally long; they have {told} rows")
        rows = [
            dict(zip(columns, cells, strict=True)) for cells in zip(*columns.values(), strict=True)
        ]
    if not are_tables(rows) or not rows:
        place = "it" if key is None else f"its key {key!r}"
        parts = content.items() if table else ()
        named = [
            name
            for name, part in parts
            if (part and are_tables(part)) or (is_table(part) and lists_of(part))
        ]
        mend = f': say rows = "{named[0]}" in the mapping' if named else ""
        raise InvalidRecording(
            f"{path}: {place} must hold a list of objects, one per row, or one list per column"
            + mend
        )
    return zip((k for k, _ in parts), rows, strict=True) if parts else enumerate(rows)


def json_part(path: Path, line: int, text: str) -> Any:
    """Read what stands in a file from a line on."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        told = str(error).replace("line 1 ", f"line {line} ")
        raise InvalidRecording(f"{path}: a log must be JSON: {told}") from error


def lists_of(table: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return the columns of an object of lists; none where a list holds objects."""
    columns = {name: values for name, values in table.items() if is_list(values)}
    holds_rows = any(isinstance(item, dict) for values in columns.values() for item in values)
    return {} if holds_rows else columns


def refuse_absent(path: Path, row: Row, sources: Iterable[str]) -> None:
    """Refuse a first row without a column that is wanted."""
    for source in sources:
        if source not in row and next(iter(STEP.findall(source)), ("", ""))[0] not in row:
            bare = all(number_in(key) is not None for key in row)
            raise InvalidRecording(
                f"{path}: no column named {shown(source)}; there are {listed(map(str, row))}"
                + (
                    ": a file without a header has its columns' names in header = [...]"
                    if bare
                    else ' (files = "run_*.csv" in the mapping takes some files alone)'
                )
            )


def place_word(path: Path) -> str:
    """Say what counts the rows of a file."""
    return "row" if path.suffix == ".json" else "line"


def number_of(
    path: Path, place: int, row: Row, ours: str, column: MappedColumn, *, commas: bool
) -> float | None:
    """Return one number of a row, as it stands there; None where its cell is empty.

    A date and a time of day are seconds in the column of time, and words tell of a switched motor.

    Args:
        commas: Whether decimals have commas.
    """
    assert column.source is not None
    found = cell(row, column.source)
    if is_missing(found):
        return None
    number = number_in(found.replace(",", ".") if commas and isinstance(found, str) else found)
    if number is None and ours == "t" and isinstance(found, str):
        seconds = seconds_of(found)
        number = None if seconds is None else seconds / column.scale
    if number is None and ours == "enabled":
        number = SWITCHED.get(str(found).strip().lower())
    if number is None:
        raise InvalidRecording(
            f"{path}: {column.source} must be a number; {place_word(path)} {place} has "
            + shown(found)
            + mend_of(str(found).strip(), ours, column.source)
        )
    return number


def mend_of(found: str, ours: str, source: str) -> str:
    """Say what to do about a cell that is no number; empty where nobody knows."""
    mark = next((m for m in COMMENTS if found.startswith(m)), None)
    if mark is not None:
        return f' (comment = "{mark}" in the mapping passes over such lines)'
    if found == source:
        return ": the header stands there again, so that a second run begins: cut the file there"
    if found.startswith("["):
        return f': column = "{source}[0]" in the mapping takes the first number of a list'
    if found.lower().startswith("0x"):
        return ": write it as a decimal number"
    if ours == "t" and ":" in found:
        return " (a date and a time of day are read as ISO writes them: 2026-03-04 23:59:55.25)"
    if ours == "t" and found[:1].isalpha():
        return f' (comment = "{found.split()[0]}" in the mapping passes over such lines)'
    return ""


def seconds_of(text: str) -> float | None:
    """Return a date with its time of day, or that time alone, in ISO's form, as seconds."""
    text = text.strip()
    if short := MINUTES.fullmatch(text):
        return 60.0 * int(short[1]) + float(short[2])
    try:
        instant = datetime.fromisoformat(text)
    except ValueError:
        try:
            instant = datetime.combine(EPOCH.date(), time.fromisoformat(text))
        except ValueError:
            return None
    since = (instant if instant.tzinfo else instant.replace(tzinfo=UTC)) - EPOCH
    return since.total_seconds()


def is_missing(value: Any) -> bool:
    """Tell whether a cell says that there is no number."""
    if isinstance(value, str):
        return value.strip().lower() in MISSING
    return value is None or (isinstance(value, float) and isnan(value))


def cell(row: Row, source: str) -> Any:
    """Return what a row holds: a column of that very name, or what a path leads to."""
    if source in row:
        return row[source]
    value: Any = row
    for key, index in STEP.findall(source):
        if isinstance(value, str):
            value = list_in(value)
        if key and is_table(value):
            value = value.get(key)
        elif index and is_list(value) and int(index) < len(value):
            value = value[int(index)]
        else:
            return None
    return value


def list_in(text: str) -> Any:
    """Return the list that stands in a cell of text, as in ``"[0.1, 0.2]"``; None where none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def number_in(value: Any) -> float | None:
    """Return a number, also one that stands in a text; None where it is none."""
    if isinstance(value, bool):
        return float(value)
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            return None
    return finite_number(value)
