"""Reference data: tables of campaigns, kept with the packings and the commits that they come from."""

from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

import pandas as pd

from jamlab.campaign.open_campaign import open_campaign
from jamlab.errors import InputError
from jamlab.storage.atomic_file import make_folder
from jamlab.storage.verified_file import versions
from studies.ensemble_tables import COLUMNS, NAMES, EnsembleTables
from studies.tables import DATA, AbsentTableError, read_manifest, read_table, write_table

_DIGITS = {"c": 4, "omega": 12, "loss": 8, "g0": 8}  # significant digits kept; 6 elsewhere. Eq 18 of [T] is met to 1e-6
_DIGITS |= {"rho": 9, "phi": 9, "rho_J": 9, "phi_J": 9, "d_phi": 9, "d_rho": 9, "overlap": 9, "shape_factor": 7}


def open_tables(source: Path = DATA) -> EnsembleTables:
    """Open the tables of a campaign (its file or folder), or of a folder with a manifest; default: those that ship."""
    known = read_manifest(source)
    if not known:
        return EnsembleTables(open_campaign(source).table, {"campaign": str(source), **versions()})
    made = {file.partition(".")[0]: f"Measured {one['date']}, commit {one['commit']}" for file, one in known.items()}
    return EnsembleTables(partial(read_table, source), {"data": source.name}, made)


def write_tables(
    tables: EnsembleTables, folder: Path, commit: str, names: Sequence[str] = NAMES, *, add: bool = False
) -> list[Path]:
    """Write the tables that have rows; `add`: below the rows that the folder has, which keep their bits."""
    made: dict[str, pd.DataFrame] = {}
    commits = dict.fromkeys(names, commit)
    for name in names:
        with suppress(InputError, AbsentTableError, KeyError):
            table = getattr(tables, name)
            kept = table[[column for column in COLUMNS[name] if column in table]]
            made[name] = round_numbers(kept.drop_duplicates(ignore_index=True))  # sweeps may share packings
    if not made:
        raise InputError(f"{folder}: no table has rows: finish some tasks of the campaign first")
    make_folder(folder)
    for name in made if add else ():
        made[name] = add_rows(read_table(folder, name), made[name])
        known = read_manifest(folder).get(f"{name}.parquet", {}).get("commit", "")
        commits[name] = " ".join(dict.fromkeys([*known.split(), commit]))
    return [write_table(folder, name, table, commits[name], kind="parquet") for name, table in made.items()]


def add_rows(known: pd.DataFrame, new: pd.DataFrame) -> pd.DataFrame:
    """Append the rows that a table lacks; columns and their types are its own."""
    missing = [str(column) for column in known if column not in new]
    if missing:
        raise InputError(f"the rows have no column {', '.join(missing)}: reduce them of a campaign that measures it")
    rows = new[list(known)].astype(known.dtypes)
    return pd.concat([known, rows], ignore_index=True).drop_duplicates(ignore_index=True)


def round_numbers(table: pd.DataFrame) -> pd.DataFrame:
    """Round the numbers of a table to the digits that are kept."""
    digits = {str(name): _DIGITS.get(str(name), 6) for name in table.select_dtypes("float")}
    return table.assign(**{name: [float(f"{v:.{digits[name]}g}") for v in table[name]] for name in digits})


MODELS = ("sp", "dp")


def example_file(model: str, n: int = 32) -> Path:
    """File of the packings of a model and size."""
    return DATA / f"packings_{model}{'' if n == 32 else f'_{n}'}.h5"  # of 32 a whole sweep
