"""Reference data are tables of campaigns, thinned to what figures use, and kept with the runs that they come from.

A folder holds one file for each table and `reference.json.xz`, the list of runs. A file has one line for each column,
its name and its values with commas between, packed by xz: columns one after the other take 40 % less than rows.
"""

import io
import json
import lzma
import warnings
import zlib
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import pandas as pd

from jamlab.campaign.campaign import open_campaign
from jamlab.campaign.versions import unlike
from jamlab.checks import check_choice
from jamlab.errors import InputError, StorageError
from jamlab.figures.explorer.write_page import explorer_fragment
from jamlab.packing.hdf5 import read_all, read_observables
from jamlab.plotting.palette import MODEL_STYLE
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.storage.verified_file import versions
from studies.ensemble_tables import (
    COLUMNS,
    COUNTS,
    DAMPING,
    FLOW_RUN,
    LATER,
    NAMES,
    PACKING,
    AbsentTableError,
    EnsembleTables,
)
from studies.ensembles import fill_states, thin_states
from studies.html_page import Section

RECORD = "reference.json.xz"  # origin of the tables
_RECORD_BEFORE = "reference.json"  # of version 0.2.0 and later ones, which is still read
TABLE_FILE = "{}.columns.xz"
_BEFORE = "{}.csv.gz"  # of version 0.2.0, which is still read
_DIGITS = {"c": 4, "omega": 12, "loss": 8, "g0": 8}  # significant digits kept; 6 elsewhere. Eq 18 of [T] is met to 1e-6
_EXACT = {"rho": 9, "phi": 9, "rho_J": 9, "phi_J": 9, "shape": 7}
_DECIMALS = {"d_phi": 9, "overlap": 9}  # at least, as rho and phi are made of them
_FLOW = [name for name in FLOW_RUN if name != "rho"]  # which follows from the others
_TEXT = ("model", "law", "ensemble")  # columns of words; all others are numbers or truth values
_TRUTHS = ("converged", "onset", "prestress", "flows", "rests")
_WHO: dict[str, list[str]] = {  # what tells the packings, and the laws that they were measured under, apart
    "states": ["model", "n", "seed", "ensemble"],
    "onset": ["model", "n", "seed", "ensemble"],
    "void_counts": ["model", "n", "seed", "ensemble"],
    "spectra": ["n", "seed", "ensemble", "target_pressure", "law", "beta", "eta_f", "prestress"],
    "quasistatic": ["n", "seed", "ensemble", "pressure", "prestress"],
    "correlation": ["n", "seed", "ensemble", "pressure", "law", "beta", "eta_f", "prestress"],
    "flow": [*_FLOW, "rate"],
    "oscillation": [*_FLOW, "omega", "amplitude"],
    "creep": [*_FLOW, "stress"],
    "droplet_states": PACKING,
    "droplet_spectra": [*PACKING, *DAMPING],
    "droplet_modes": [*PACKING, *DAMPING],
    "droplet_voids": PACKING,
}


def combine(new: EnsembleTables, old: EnsembleTables) -> EnsembleTables:
    """Add packings to tables that are there: a packing of both is that of the new ones. Its numbers differ in digits
    that were not kept, so both are compared as they are written."""

    def read(name: str) -> pd.DataFrame:
        parts: list[pd.DataFrame] = []
        for tables, absent in ((new, (InputError, AbsentTableError, KeyError)), (old, (InputError, AbsentTableError))):
            try:
                parts.append(getattr(tables, name))
            except absent:
                continue
        if len(parts) < 2:
            return parts[0] if parts else pd.DataFrame()
        first, second = (_who(name, part) for part in parts)
        shared = set(parts[0]) & set(parts[1]) | {*COUNTS, *LATER}  # these came later: nan in packings from before
        kept = [[c for c in COLUMNS[name] if c in part and c in shared] for part in parts]
        return pd.concat([parts[0][kept[0]], parts[1].loc[~second.isin(first), kept[1]]], ignore_index=True)

    return EnsembleTables(read, old.facts | new.facts)


def _who(name: str, table: pd.DataFrame) -> pd.MultiIndex:
    """What tells the packings of a table apart, in digits that are kept and that every machine repeats."""
    found = _round_floats(table[_WHO[name]])
    if "phi" in found:
        found["phi"] = found["phi"].round(6)
    return pd.MultiIndex.from_frame(found.fillna(-1))


def reference_tables() -> EnsembleTables:
    """Tables of the reference data shipped with jamlab."""
    return read_folder(Path(str(resources.files("studies"))) / "reference")


def read_folder(folder: Path) -> EnsembleTables:
    """Read tables from a folder that `save` wrote."""
    return EnsembleTables(partial(_read_table, folder), _facts(read_record(folder)["runs"]))


def has_table(folder: Path, name: str) -> bool:
    """Whether a folder holds a table."""
    return any((folder / form.format(name)).exists() for form in (TABLE_FILE, _BEFORE))


def _facts(runs: Sequence[dict[str, Any]]) -> dict[str, str]:
    """What a page says of the runs: all of the last one, and campaign and commit of those of other campaigns."""
    facts = {name: str(value) for name, value in runs[-1].items() if name not in ("file", "rows")}
    commits = {run.get("campaign", ""): run.get("commit", "unknown") for run in runs}
    others = {name: commit for name, commit in commits.items() if name != runs[-1].get("campaign", "")}
    return facts | {f"campaign {name}": f"commit {commit}" for name, commit in others.items()}


def has_record(folder: Path) -> bool:
    """Whether a folder is one of reference tables."""
    return any((folder / name).is_file() for name in (RECORD, _RECORD_BEFORE))


def read_record(folder: Path) -> dict[str, Any]:
    """Read the runs of a folder, oldest first, and the rows of each table."""
    record = folder / RECORD if (folder / RECORD).exists() else folder / _RECORD_BEFORE
    remedy = "give a folder of reference tables or a campaign"
    try:
        data = record.read_bytes()
        content = json.loads(lzma.decompress(data) if record.name == RECORD else data)
    except (OSError, EOFError, ValueError, lzma.LZMAError) as error:
        raise StorageError(f"{record} cannot be read ({error}): {remedy}") from None
    if isinstance(content, dict) and isinstance(content.get("facts"), dict):
        content = _flat(content)
    parts = {"runs": list, "rows": dict}
    if not isinstance(content, dict) or not all(isinstance(content.get(part), kind) for part, kind in parts.items()):
        raise StorageError(f"{record} cannot be read (it lacks runs or rows): {remedy}")
    return content


def _flat(content: dict[str, Any]) -> dict[str, Any]:
    """The record of version 0.2.0, in which every run held the one before it."""
    runs: list[dict[str, Any]] = []
    rows: dict[str, int] = {}
    inner: dict[str, Any] | None = content
    while inner is not None:
        if not isinstance(inner.get("rows"), dict):
            return {}
        runs.append({**inner["facts"], "rows": inner["rows"], "file": inner.get("campaign", "")})
        rows = inner["rows"] | rows
        inner = inner.get("before")
    return {"runs": runs[::-1], "rows": rows}


def _read_table(folder: Path, name: str) -> pd.DataFrame:
    path = folder / TABLE_FILE.format(name)
    if not path.exists() and (old := folder / _BEFORE.format(name)).exists():
        path = old
    remedy = f"make it with a campaign that measures {name}"
    try:
        source: Path | io.StringIO = path
        if path.suffix != ".gz":  # columns that stand in lines
            columns = (line.split(",") for line in lzma.decompress(path.read_bytes()).decode().splitlines())
            source = io.StringIO("\n".join(map(",".join, zip(*columns, strict=True))))
        table = pd.read_csv(source, low_memory=False)  # in parts, a column with one bad cell would be of two types
    except FileNotFoundError as error:
        raise AbsentTableError(f"{path} cannot be read ({error}): {remedy}") from None
    except (OSError, ValueError, EOFError, zlib.error, lzma.LZMAError) as error:
        raise StorageError(f"{path} cannot be read ({error}): {remedy}") from None
    lacking = [column for column in _WHO[name] if column not in table]
    if lacking:
        raise StorageError(f"{path} has no column {', '.join(lacking)}: {remedy}")
    for column in table:
        cells = table[column]
        bad = cells[_is_bad(cells)]
        if len(bad):
            where = f"line {bad.index[0] + 2}, column {column}: {bad.iloc[0]!r}"
            raise StorageError(f"{path} cannot be read ({where}): {remedy}")
    expected = read_record(folder)["rows"].get(name)
    if expected not in (None, len(table)):
        raise StorageError(f"{path} has {len(table)} rows, {expected} expected by {RECORD}: {remedy}")
    return fill_states(table) if name == "states" else table


def pack(csv: str) -> bytes:
    """Pack the CSV text of a table, none of whose cells holds a comma, column by column."""
    columns = zip(*(line.split(",") for line in csv.splitlines()), strict=True)
    text = {"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "lc": 4, "pb": 0}  # the least for digits
    return lzma.compress("\n".join(map(",".join, columns)).encode(), filters=[text])


def _is_bad(column: "pd.Series[Any]") -> "pd.Series[bool]":
    """Cells that are not what their column holds: numbers or truth values, but for a few of words."""
    if column.name in _TEXT or column.dtype.kind in "biuf":
        return pd.Series(False, column.index)
    if column.name in _TRUTHS:
        return column.notna() & ~column.astype(str).isin(("True", "False"))
    return column.notna() & pd.to_numeric(column, errors="coerce").isna()


def save(
    tables: EnsembleTables,
    folder: Path,
    facts: dict[str, Any],
    campaign: str = "",
    *,
    add: bool = False,
    names: Sequence[str] = NAMES,
) -> dict[str, int]:
    """Write the tables as reference data, thinned to what figures use: about 6 digits, and one record of their origin,
    with facts and the text of the campaign file; with `add` the runs on record stay, see `combine`. Returns bytes by
    table."""
    made: dict[str, pd.DataFrame] = {}
    for name in names:
        with suppress(InputError, AbsentTableError, KeyError):
            made[name] = getattr(tables, name)
    if not made:
        raise InputError("no table has rows: finish some tasks of the campaign first")
    lost = [name for name in NAMES if name not in made and has_table(folder, name)]
    if lost and not add:
        raise InputError(
            f"{folder} holds {', '.join(lost)}, which would no longer match its record: add to it with "
            "--add, or name another folder"
        )
    make_folder(folder)
    before = read_record(folder) if add else {"runs": [], "rows": {}}
    written: dict[str, int] = {}
    rows: dict[str, int] = {}
    for name, table in made.items():
        path = folder / TABLE_FILE.format(name)
        kept = _round_floats(table[[c for c in COLUMNS[name] if c in table]])
        if name == "states":
            kept = thin_states(kept)
        with atomic_file(path) as temporary:
            temporary.write_bytes(pack(kept.to_csv(index=False)))
        (folder / _BEFORE.format(name)).unlink(missing_ok=True)
        written[name], rows[name] = path.stat().st_size, len(kept)
    runs = [*before["runs"], {**facts, "rows": rows, "file": campaign}]
    content = {"schema": "jamlab-reference", "version": 2, "runs": runs, "rows": before["rows"] | rows}
    with atomic_file(folder / RECORD) as temporary:
        temporary.write_bytes(lzma.compress(json.dumps(content).encode()))
    (folder / _RECORD_BEFORE).unlink(missing_ok=True)
    return written


def _round_floats(table: pd.DataFrame) -> pd.DataFrame:
    out = table.copy()
    for name in out.select_dtypes("float").columns:
        digits = _EXACT.get(name, _DIGITS.get(name, 6))
        out[name] = [float(f"{value:.{digits}g}") for value in out[name]]
        if name in _DECIMALS:
            out[name] = out[name].where(out[name].abs() < 1e-3, table[name].round(_DECIMALS[name]))
    return out


def open_tables(source: Path | None) -> EnsembleTables:
    """Open the tables of a campaign (its file or folder) or a folder of reference tables; None: those installed."""
    if source is None:
        return reference_tables()
    if has_record(source):
        return read_folder(source)
    campaign = open_campaign(source)
    return EnsembleTables(campaign.table, {"campaign": str(source), **versions()})


def save_reference(
    source: Path, folder: Path, commit: str, add: bool = False, only: Sequence[str] = ()
) -> dict[str, int]:
    """Reduce the tables of a campaign to reference data, and record their origin; with `add` packings stay that the
    campaign lacks, and a warning names what has several versions then. Returns bytes by table."""
    for name in only:
        check_choice("only", name, NAMES)
    campaign = open_campaign(source)
    rows = campaign.table("states")
    made = {name: "; ".join(part for part in sorted(set(rows[name])) if part) for name in ("protocol", "definitions")}
    facts = {"campaign": campaign.name, "commit": commit, **versions(), **made}
    tables, text = EnsembleTables(campaign.table), campaign.file.read_text(encoding="utf-8")
    if not add:
        return save(tables, folder, facts, text, names=only or NAMES)
    names = only or [name for name in NAMES if has_table(folder, name)]
    old = read_folder(folder)
    for name, now in made.items():
        if mixed := unlike([now, *(run.get(name) for run in read_record(folder)["runs"])]):
            warnings.warn(f"{folder} then holds packings of several versions of {' and '.join(mixed)}", stacklevel=2)
    for name in names:  # all are read before any is replaced
        with suppress(InputError, AbsentTableError):
            getattr(old, name)
    return save(combine(tables, old), folder, facts, text, add=True, names=names)


MODELS = ("sp", "dp")


def example_file(model: str, n: int = 32) -> Path:
    """File of the packings of a model and size, installed with jamlab."""
    size = "" if n == 32 else f"_{n}"  # of 32 a whole sweep
    return Path(str(resources.files("studies"))) / "reference" / f"packings_{model}{size}.h5"


def example_sections() -> list[Section]:
    """One section for each model with an explorer of its packings."""
    sections = []
    for model in MODELS:
        path = example_file(model)
        fragment = explorer_fragment(read_all(path), observables=read_observables(path))
        sections.append(Section(f"One packing of N = 32: {MODEL_STYLE[model]['label']}", fragment=fragment))
    return sections
