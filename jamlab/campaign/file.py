"""Read a campaign file: TOML, checked against `file_tables.py` before anything runs; a line for each wrong key."""

import os
import stat
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from jamlab.campaign.file_problems import explain
from jamlab.campaign.file_tables import CampaignTable, Compression, DampingLaws, SeedRange, SweepTable, Tolerances
from jamlab.campaign.file_values import FileTable, LogGrid
from jamlab.campaign.flow_file import Creeping, Flow, Oscillating
from jamlab.errors import InputError, JamlabError

MOST_BYTES = 10_000_000  # of a campaign file


def read_campaign_file(path: str | os.PathLike[str]) -> CampaignTable:
    """Read and check a campaign file.

    Raises:
        InputError: the file cannot be read, is not TOML, or is not a valid campaign; one line for each wrong key, with
            its value and a remedy.
    """
    try:
        content = tomllib.loads(_read_text(path))
    except OSError as error:
        raise InputError(f"cannot read the campaign file {path}: {error.strerror}; check its name") from error
    except RecursionError as error:
        raise InputError(f"{path} nests brackets too deeply: write the lists of a campaign flat") from error
    except ValueError as error:  # of TOML, of UTF-8, or an integer of more than 4300 digits
        if isinstance(error, JamlabError):
            raise
        raise InputError(f"{path} is not TOML: {error}; correct that line") from error
    try:
        return CampaignTable.model_validate(content)
    except ValidationError as error:
        problems = [problem for problem in error.errors() if problem["type"] != "is_instance_of"]  # of `list | range`
        lines = [explain(content, problem, _known_keys) for problem in problems]
        raise InputError("\n".join(f"{path}: {line}" for line in dict.fromkeys(lines))) from None


def _read_text(path: str | os.PathLike[str]) -> str:
    """Read a file of a sensible size; a device or a pipe could be read without end, and not twice."""
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"cannot read the campaign file {path}: it is not a regular file; give a file")
    if status.st_size > MOST_BYTES:
        raise InputError(f"{path} has {status.st_size} bytes, a campaign file at most {MOST_BYTES}: check its name")
    return Path(path).read_text(encoding="utf-8")


def _known_keys(place: list[Any]) -> list[str]:
    """List the keys of the table that contains the last part of a place."""
    table: type[FileTable] = CampaignTable
    inner: dict[Any, type[FileTable]] = {
        "sweep": SweepTable,
        "seeds": SeedRange,
        "compress": Compression,
        "damping": DampingLaws,
        "omega": LogGrid,
        "correlation_omega": LogGrid,
        "flow": Flow,
        "oscillation": Oscillating,
        "creep": Creeping,
        "amplitudes": LogGrid,
        "stresses": LogGrid,
        "rates": LogGrid,
        "tolerances": Tolerances,
    }
    for part in place[:-1]:
        table = inner.get(part, table)
    return list(table.model_fields)
