"""Open the tables behind the figures: those of a campaign, or the reference data installed with jamlab."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from jamlab.campaign.campaign import open_campaign
from jamlab.checks import check_choice
from jamlab.errors import InputError
from jamlab.storage.verified_file import versions
from jamlab.studies.ensemble_tables import NAMES, AbsentTableError, EnsembleTables
from jamlab.studies.reference_data import RECORD, combine, has_table, read_folder, reference_tables, save


def open_tables(source: Path | None) -> EnsembleTables:
    """Open the tables of a campaign (its file or folder) or a folder of reference tables; None: those installed."""
    if source is None:
        return reference_tables()
    if (source / RECORD).is_file():
        return read_folder(source)
    campaign = open_campaign(source)
    return EnsembleTables(campaign.table, {"campaign": str(source), **versions()})


def save_reference(
    source: Path, folder: Path, commit: str, add: bool = False, only: Sequence[str] = ()
) -> dict[str, int]:
    """Reduce the tables of a campaign to reference data, and record their origin; with `add` packings stay that the
    campaign lacks. Returns bytes by table."""
    names = _check_tables(only)
    campaign = open_campaign(source)
    facts = {"campaign": campaign.name, "commit": commit, **versions()}
    tables, text = EnsembleTables(campaign.table), campaign.file.read_text(encoding="utf-8")
    if not add:
        return save(tables, folder, facts, text, names=names)
    names = only or [name for name in NAMES if has_table(folder, name)]
    old = read_folder(folder)
    for name in names:  # all are read before any is replaced
        with suppress(InputError, AbsentTableError):
            getattr(old, name)
    return save(combine(tables, old), folder, facts, text, add=True, names=names)


def _check_tables(only: Sequence[str]) -> Sequence[str]:
    """Names of the tables asked for, all if none is."""
    for name in only:
        check_choice("only", name, NAMES)
    return only or NAMES
