"""Read the text of a campaign: of its file, or of the copy in its folder."""

import os

from jamlab.errors import InputError
from jamlab.storage.system_errors import system_said

COPY = "campaign.toml"  # of the campaign file, in the folder of its tasks
MOST_BYTES = 10_000_000  # of a campaign file


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a file of a sensible size; a device may have no end."""
    try:
        with open(path, "rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise InputError(f"{path} is no campaign file: it has more than {MOST_BYTES} bytes; choose another file")
        return content.decode("utf-8-sig")  # some editors begin a file with a byte order mark
    except OSError as error:
        raise InputError(f"cannot read the campaign file {path}: {system_said(error, 'check its name')}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not TOML: {error}; correct that line") from error
