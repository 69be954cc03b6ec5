"""The zip archive that a TorchScript file is, read without torch and without running anything."""

import io
import struct
import zipfile
import zlib

from tendon_newton.errors import TendonNewtonError

START = b"PK"  # First bytes of the file
TEXT_LIMIT = 1 << 20
"""Bytes of a text beside the program; a card with a thousand recordings has a tenth of it."""
PACKING = 10
"""Most that packing may save [1]: weights are stored as they are, code is packed to a fifth."""
DAMAGE = (
    zipfile.BadZipFile,
    NotImplementedError,
    EOFError,
    RuntimeError,
    ValueError,
    OSError,
    zlib.error,
    struct.error,
)
"""What Python's zip reader raises at bytes that are none of an archive."""


def read_extra(content: bytes, name: str, what: str, fault: type[TendonNewtonError]) -> str:
    """Return one of the extra texts of a TorchScript file; nothing else of it is unpacked.

    Args:
        name: Name of the text, such as ``card.json``.
        what: What the file should be, in words ("a force network").
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            found = [i for i in archive.infolist() if i.filename.endswith(f"/extra/{name}")]
            if len(found) != 1 or found[0].file_size > TEXT_LIMIT:
                sizes = f" of {found[0].file_size:,} bytes" if len(found) == 1 else ""
                raise fault(
                    f"{what} has one card, extra/{name}, of at most {TEXT_LIMIT:,} bytes; this "
                    f"archive has {len(found)}{sizes}: it was not written by this program"
                )
            return archive.read(found[0]).decode("utf-8")
    except UnicodeDecodeError as error:
        raise fault("card: must be UTF-8 text") from error
    except DAMAGE as error:
        raise damaged(error, fault) from error


def refuse_damage(content: bytes, fault: type[TendonNewtonError]) -> None:
    """Refuse an archive with wrong checksums, at which torch itself may crash, or a bomb."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            claimed = sum(entry.file_size for entry in archive.infolist())
            if claimed > PACKING * len(content):
                raise fault(
                    f"a TorchScript file packs to a {PACKING}th at most; this archive of "
                    f"{len(content):,} bytes claims {claimed:,}"
                )
            if (broken := archive.testzip()) is not None:
                raise zipfile.BadZipFile(f"{broken} has the wrong checksum")
    except DAMAGE as error:
        raise damaged(error, fault) from error


def damaged(error: Exception, fault: type[TendonNewtonError]) -> TendonNewtonError:
    """Say that a file is no whole archive."""
    return fault(
        f"a TorchScript file is a zip archive; this one is damaged, cut short or something else "
        f"({error})"
    )
