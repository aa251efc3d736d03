"""`jamlab analyze` of a file of several pages: droplets are measured in every frame and tracked through all."""

from pathlib import Path
from typing import Any

from jamlab.cli.console import print_json, print_note, print_table
from jamlab.errors import InputError
from jamlab.storage.table_file import write_table


def is_series(*files: Path | None) -> bool:
    """Whether one of the files has several pages."""
    from jamlab.micrographs.picture_files import count_pages

    return any(count_pages(file) > 1 for file in files if file is not None)


def refuse_for_series(given: dict[str, Path | None]) -> None:
    """Refuse options that are for a single picture."""
    if wrong := [name for name, value in given.items() if value is not None]:
        raise InputError(
            f"{', '.join(wrong)}: not for a series of pictures; save one page as its own file, or leave it out"
        )


def analyze_series(
    name: str, file: Path | None, labels: Path | None, memory: int, how: dict[str, Any], csv: Path | None, as_json: bool
) -> None:
    """Track droplets, write a row per droplet and frame to `csv` if it is given, and print a row per frame."""
    from jamlab.micrographs.tracks import link_frames, measure_frames

    plain = {key: value for key, value in how.items() if value is not None and (labels is None or key != "contrast")}
    frames = measure_frames(file, labels, plain)
    tracks = link_frames(frames, memory)
    if csv is not None:
        write_table(tracks, csv)
    lengths, unit = tracks.groupby("particle").size(), tracks.attrs["unit"] or "of --pixel"
    through = int((lengths == len(frames)).sum())
    if as_json:
        rows = [None if each is None else _facts(each) for each in frames]
        print_json({"frames": rows, "unit": unit, "particles": len(lengths), "in_all_frames": through})
        return
    lines = [
        [str(number), *(_row(each) if each is not None else ["0", *[""] * 4])] for number, each in enumerate(frames)
    ]
    print_table(f"droplets of {name}", ["frame", "count", "cut", "rho", "z", "quality"], lines)
    print_note(f"{len(lengths)} droplets are tracked, {through} of them through all {len(frames)} frames; unit: {unit}")


def _facts(found: Any) -> dict[str, Any]:
    values = {key: number.value for key, number in found.numbers.items()}
    return values | {"cut": found.cut, "quality": found.quality, "reasons": list(found.reasons)}


def _row(found: Any) -> list[str]:
    return [str(found.count), str(found.cut), f"{found.rho:.4g}", f"{found.z:.3g}", found.quality]
