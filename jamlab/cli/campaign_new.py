"""`jamlab campaign new`: a commented campaign file to start from."""

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.console import print_note
from jamlab.errors import InputError, StorageError


def new(file: Annotated[Path, typer.Argument(metavar="FILE", help="Campaign file (TOML) to write.")]) -> None:
    """Write a commented campaign of two small sweeps, to be edited; never replaces a file."""
    text = files("jamlab.campaign").joinpath("starter.toml").read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(f"{file} exists: name another file, or remove it first") from None
    except OSError as error:
        raise StorageError(f"cannot write {file}: {error.strerror or error}; name another file") from error
    print_note(f"wrote {file}; next: jamlab campaign plan {file}")
