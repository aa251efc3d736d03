"""Exchange campaigns with other machines and programs: merge folders, export tables and frames."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jamlab.campaign.campaign import Campaign
from jamlab.campaign.folder import CampaignFolder, damage
from jamlab.campaign.observables import TABLES
from jamlab.checks import check_choice
from jamlab.errors import InputError
from jamlab.packing.lammps_files import write_dump
from jamlab.storage.atomic_file import atomic_file, check_target, make_folder

if TYPE_CHECKING:
    import pandas as pd

FORMATS = ("csv", "parquet", "dump")


def merge(campaign: Campaign, sources: Sequence[Path]) -> dict[str, int]:
    """Copy the campaign file, and finished tasks that it lacks from other folders, since the same task has the same
    content wherever it ran; counts files "copied", already "present", and "damaged", hence left out."""
    for source in sources:
        if not (source / "tasks").is_dir():
            raise InputError(f"no campaign has run in the folder {source}: give folders that contain a folder tasks")
    counts = {"copied": 0, "present": 0, "damaged": 0}
    campaign.folder.prepare()
    with campaign.folder.lock():
        campaign.folder.keep_copy(campaign.text)
        for other in map(CampaignFolder, sources):
            for name in sorted(other.finished()):
                target = campaign.folder.task_file(name)
                if target.exists():
                    counts["present"] += 1
                elif damage(other.task_file(name), name) is not None:
                    counts["damaged"] += 1
                else:
                    with atomic_file(target) as temporary:
                        temporary.write_bytes(other.task_file(name).read_bytes())
                    counts["copied"] += 1
    return counts


def export_table(frame: "pd.DataFrame", path: Path) -> None:
    """Write a table as .csv (17 digits: every number comes back) or .parquet, all or nothing."""
    if path.suffix not in (".csv", ".parquet"):
        raise InputError(f"cannot tell what to write to {path}: end its name in .csv or .parquet")
    if path.suffix == ".parquet":
        check_parquet()
    with atomic_file(path) as temporary:
        if path.suffix == ".csv":
            frame.to_csv(temporary, index=False, float_format="%.17g")
        else:
            frame.to_parquet(temporary, index=False, engine="pyarrow")


def check_parquet() -> None:
    """Check that Parquet can be written."""
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise InputError("Parquet needs pyarrow: pip install 'jamlab[parquet]', or export csv") from None


def export(
    campaign: Campaign,
    out: Path,
    form: str = "csv",
    tables: Sequence[str] = (),
    sweep: str | None = None,
    *,
    replace: bool = True,
) -> list[Path]:
    """Write tables, by default all with rows, as "csv" or "parquet", or a LAMMPS text "dump" of every task for OVITO;
    returns their paths. Where one is there and `replace` is False, none is written."""
    check_choice("format", form, FORMATS)
    if form == "parquet":
        check_parquet()
    if form == "dump":
        written: dict[Path, Any] = {out / f"{name}.dump": name for name in sorted(campaign.finished(sweep))}
    else:
        frames = {
            name: campaign.table(name, sweep) for name in tables or TABLES
        }  # all of them, before a folder is made
        written = {out / f"{name}.{form}": frame for name, frame in frames.items() if len(frame) or tables}
    if written:
        make_folder(out)
    for path in written:
        check_target(path, replace=replace)
    for path, content in written.items():
        if form == "dump":
            write_dump(path, campaign.packings(content))
        else:
            export_table(content, path)
    return list(written)
