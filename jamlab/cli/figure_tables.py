"""Open the tables behind the figures: those of a campaign, or the reference data installed with jamlab."""

from pathlib import Path

from jamlab.campaign.campaign import open_campaign
from jamlab.figures.papers.tables import EnsembleTables, read_folder, reference_tables, save
from jamlab.packing.versions import versions


def open_tables(source: Path | None) -> EnsembleTables:
    """Open the tables of a campaign (its file or folder) or a folder of reference tables.

    Args:
        source: None stands for the reference data installed with jamlab.

    Raises:
        InputError, StorageError: `source` is neither.
    """
    if source is None:
        return reference_tables()
    if (source / "reference.json").is_file():
        return read_folder(source)
    campaign = open_campaign(source)
    return EnsembleTables(campaign.table, {"campaign": str(source), **versions()})


def save_reference(source: Path, folder: Path, commit: str) -> dict[str, int]:
    """Reduce the tables of a campaign to reference data, and record their origin.

    Args:
        source: campaign file or folder.
        folder: to write to.
        commit: of the code that ran the campaign.

    Returns:
        Table -> size in bytes.

    Raises:
        InputError: there is no campaign, or none of its tasks is finished.
        StorageError: the folder cannot be written.
    """
    campaign = open_campaign(source)
    facts = {"campaign": campaign.name, "commit": commit, **versions()}
    return save(EnsembleTables(campaign.table), folder, facts, campaign.file.read_text(encoding="utf-8"))
