"""What the cards of networks and of policies share: JSON that is checked value by value."""

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.json_file import refuse_constant
from tendon_newton.data.files.values import is_table
from tendon_newton.errors import TendonNewtonError, shown

Card = TypeVar("Card")
Promise = tuple[str, Any, bool, str]  # A name, what came, whether it holds, and what is promised
REASON_LENGTH = 200  # Most that is repeated of what Python says of a value [characters]


def read_card_json(
    text: str,
    build: Callable[[CheckedTable], Card],
    first: Mapping[str, Any],
    fault: type[TendonNewtonError],
) -> Card:
    """Read a card.

    Args:
        build: Makes a card of the table that JSON gives.
        first: Keys that must have these values; in another version the rest may look different.
    """
    try:
        table = json.loads(text, parse_constant=refuse_constant)
    except (ValueError, RecursionError) as error:
        raise fault(f"card: must be JSON; {error}") from error
    if not is_table(table):
        raise fault(f"card: must be a JSON object; it is {shown(table)}")
    refuse_broken(
        ((k, table.get(k), table.get(k) == wanted, repr(wanted)) for k, wanted in first.items()),
        fault,
    )
    try:
        return build(CheckedTable(table, "card", fault))
    except KeyError as error:
        raise fault(f"card: key {error.args[0]!r} is missing") from error
    except (TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        reason = str(error)[:REASON_LENGTH]
        raise fault(f"card: a value has the wrong type: {reason}") from error


def refuse_broken(
    promises: Iterable[Promise], fault: type[TendonNewtonError], owner: str = ""
) -> None:
    """Refuse a card that breaks a promise, naming the first one.

    Args:
        owner: Part of the card that the names belong to, as in " of servo 1".
    """
    for name, came, kept, promised in promises:
        if not kept:
            raise fault(f"card: {name}{owner} must be {promised}; it is {shown(came)}")
