"""Reference packings: sets of packings as files, with a data card, ready to be deposited under a DOI.

A set is one HDF5 file of packings that differ by their seed alone. Each is made by one call of jamlab, which the card
prints, so that anyone can make it again and compare.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

import jamlab
from jamlab.arguments.choices import QuantityName
from jamlab.checks import check_choice
from jamlab.errors import StorageError
from jamlab.packing.quantities import MEASURED as QUANTITIES
from jamlab.processes.progress import Progress, told
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.storage.verified_file import versions
from studies.tables import DATA, commit, one_core, read_manifest, write_manifest

FOLDER = DATA / "packings"
CARD, METADATA = "DATA_CARD.md", "datacite.json"
LICENCE = ("CC-BY-4.0", "https://creativecommons.org/licenses/by/4.0/legalcode")
TITLE = "Jammed two-dimensional packings of soft disks and of deformable droplets"
# what a set keeps of each packing beside its positions, see `jamlab.measure`
MEASURED: tuple[QuantityName, ...] = ("rho", "phi", "z", "rattlers", "pressure", "energy", "g", "g_x", "b", "max_force")
# digits to which a packing that is made again has the same numbers, and what is 0 but for rounding
RELATIVE, ABSOLUTE = 1e-6, 1e-11


@dataclass(frozen=True)
class PackingSet:
    """Packings of one protocol, one for each seed."""

    model: Literal["sp", "dp"]
    n: int
    state: str  # as a word of a file name
    seeds: int  # from 1 on
    call: str  # that makes one, of `seed`

    @property
    def name(self) -> str:
        """Of the file, without its ending."""
        return f"{self.kind}-{self.n}-{self.state}"

    @property
    def kind(self) -> str:
        """Of the particles, in a word."""
        return "disks" if self.model == "sp" else "droplets"

    def make(self, seed: int) -> jamlab.Packing:
        """The packing of a seed, by the call that the card prints."""
        made = _CALLS[self.state.partition("-")[0]](self, seed)
        if not made.converged:
            raise StorageError(f"{self.name}, seed {seed}: the packing did not converge, and no set holds such a one")
        return made


def _of_onset(which: PackingSet, seed: int) -> jamlab.Packing:
    return jamlab.jam(which.n, which.model, seed, start="from-disks")


def _of_pressure(which: PackingSet, seed: int) -> jamlab.Packing:
    return jamlab.pack(which.n, float(which.state.partition("-")[2]), seed)


def _of_density(which: PackingSet, seed: int) -> jamlab.Packing:
    return [*jamlab.compress(_of_onset(which, seed), float(which.state.partition("-")[2]), 0.01)][-1]


_CALLS: dict[str, Callable[[PackingSet, int], jamlab.Packing]] = {
    "onset": _of_onset,
    "pressure": _of_pressure,
    "rho": _of_density,
}


_START = {"sp": "", "dp": ', start="from-disks"'}  # of droplets, not the usual one


def _onsets(model: Literal["sp", "dp"], n: int, seeds: int) -> PackingSet:
    return PackingSet(model, n, "onset", seeds, f'jamlab.jam({n}, "{model}", seed{_START[model]})')


def _pressures(n: int, seeds: int, *pressures: str) -> list[PackingSet]:
    return [PackingSet("sp", n, f"pressure-{p}", seeds, f"jamlab.pack({n}, {p}, seed)") for p in pressures]


def _densities(n: int, seeds: int, *densities: str) -> list[PackingSet]:
    onset = f'jamlab.jam({n}, "dp", seed{_START["dp"]})'
    return [PackingSet("dp", n, f"rho-{r}", seeds, f"[*jamlab.compress({onset}, {r}, 0.01)][-1]") for r in densities]


SETS = (
    _onsets("sp", 64, 100),
    *_pressures(64, 100, "1e-2", "1e-4"),
    _onsets("sp", 256, 40),
    *_pressures(256, 40, "1e-2", "1e-3", "1e-4", "1e-5"),
    _onsets("sp", 1024, 20),
    *_pressures(1024, 20, "1e-2", "1e-4"),
    _onsets("dp", 32, 40),
    *_densities(32, 40, "0.90", "0.95", "0.99"),
    _onsets("dp", 64, 20),
    *_densities(64, 20, "0.95"),
)
BY_NAME = {each.name: each for each in SETS}


def make_sets(folder: Path, names: Sequence[str] = (), progress: Progress | None = None) -> list[Path]:
    """Make the sets that a folder does not hold, each file as soon as it is complete, and its card.

    Args:
        folder: of the files, the manifest, the card and the metadata.
        names: of sets; default: all.
        progress: is told each packing.

    Raises:
        InputError: no set has such a name.
        StorageError: a packing did not converge.
    """
    for name in names:
        check_choice("set", name, tuple(BY_NAME))
    make_folder(folder)
    chosen = [BY_NAME[name] for name in names] or SETS
    made = [_make_set(folder, each, progress) for each in chosen if f"{each.name}.h5" not in read_manifest(folder)]
    write_card(folder)
    return made


def _make_set(folder: Path, which: PackingSet, progress: Progress | None) -> Path:
    path, packings = folder / f"{which.name}.h5", []
    with one_core():
        for seed in range(1, which.seeds + 1):
            told(progress)(seed / which.seeds, f"{which.name}: seed {seed} of {which.seeds}")
            packings.append(which.make(seed))
    rows = [measured(each) for each in packings]
    numbers = {str(name): np.array([row[name] for row in rows]) for name in MEASURED}
    jamlab.write(path, packings, {"seed": np.arange(1, which.seeds + 1.0), **numbers})
    known = read_manifest(folder)
    row = {"rows": str(which.seeds), "sha256": _digest(path), "commit": commit()}
    write_manifest(folder, known | {path.name: {**row, "date": datetime.now(UTC).date().isoformat()}})
    return path


def measured(packing: jamlab.Packing) -> dict[str, float]:
    """What a set keeps of a packing."""
    return dict(jamlab.measure(packing, MEASURED))


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def check_sets(folder: Path = FOLDER, again: int = 1, progress: Progress | None = None) -> list[str]:
    """Compare the files with the manifest, what they hold with what is measured, and packings that are made again.

    Args:
        folder: of the files.
        again: how many seeds of each set are made again.
        progress: is told each set.

    Returns:
        One line for each difference.
    """
    wrong: list[str] = []
    known = read_manifest(folder)
    for count, (file, row) in enumerate(sorted(known.items())):
        told(progress)(count / len(known), file)
        path = folder / file
        if not path.is_file():
            wrong.append(f"{file}: the manifest names it, but it is not there")
        elif _digest(path) != row["sha256"]:
            wrong.append(f"{file}: it is not the file of {row['date']} that the manifest names")
        else:
            wrong += _differences(BY_NAME[path.stem], path, again)
    return wrong


def _differences(which: PackingSet, path: Path, again: int) -> list[str]:
    import h5py

    with h5py.File(path) as file:
        kept = {name: file[f"observables/{name}/value"][:] for name in ("seed", *MEASURED)}
    packings = jamlab.read_all(path)
    wrong = []
    for k in range(min(again, len(packings))):
        for origin, packing in (("read", packings[k]), ("made again", which.make(int(kept["seed"][k])))):
            for name, value in measured(packing).items():
                if not np.isclose(value, kept[name][k], rtol=RELATIVE, atol=ABSOLUTE, equal_nan=True):
                    wrong.append(
                        f"{path.name}, seed {kept['seed'][k]:g}, {origin}: {name} = {value!r}, {kept[name][k]!r}"
                    )
    return wrong


# the card -------------------------------------------------------------------------------------------------------------


def write_card(folder: Path) -> None:
    """Write the data card of the sets that a folder holds, and their metadata by the schema of DataCite."""
    known = read_manifest(folder)
    sets = [each for each in SETS if f"{each.name}.h5" in known]
    text = "\n".join([*_head(known), *_table(folder, sets, known), *_foot(folder, sets, known)]) + "\n"
    for name, content in ((CARD, text), (METADATA, json.dumps(_metadata(sets, known), indent=2) + "\n")):
        with atomic_file(folder / name) as temporary:
            temporary.write_text(content, encoding="utf-8")


def _head(known: dict[str, dict[str, str]]) -> list[str]:
    total = sum(int(row["rows"]) for row in known.values())
    return [
        f"# {TITLE}",
        "",
        f"{total} packings in {len(known)} files. All packings of a file have one protocol and differ by their seed "
        "alone. Every packing is an energy minimum; `max_force` is its largest residual force.",
        "",
        "## Sets",
        "",
    ]


def _table(folder: Path, sets: Sequence[PackingSet], known: dict[str, dict[str, str]]) -> list[str]:
    rows = ["| file | packings | call | ρ | z | g |", "|---|---:|---|---:|---:|---:|"]
    for each in sets:
        means = _means(folder / f"{each.name}.h5")
        cells = [each.name + ".h5", known[f"{each.name}.h5"]["rows"], f"`{each.call}`", *means]
        rows.append(f"| {' | '.join(cells)} |")
    return [*rows, "", "*Mean and standard error of the last digits; `seed` runs from 1 on.*"]


def _means(path: Path) -> list[str]:
    import h5py

    with h5py.File(path) as file:
        columns = [file[f"observables/{name}/value"][:] for name in ("rho", "z", "g")]
    return [_with_error(column[np.isfinite(column)]) for column in columns]


def _with_error(values: np.ndarray) -> str:
    if len(values) < 2:
        return "-"
    mean, error = float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values)))
    if error == 0 or error < 1e-7 * abs(mean):  # the target of the protocol
        return f"{mean:.6g}"
    digits = max(0, 1 - int(np.floor(np.log10(error))))
    return f"{mean:.{digits}f}({round(error * 10**digits)})"


def _foot(folder: Path, sets: Sequence[PackingSet], known: dict[str, dict[str, str]]) -> list[str]:
    made = sorted({(row["commit"], row["date"]) for row in known.values()})
    return [
        "",
        "## Model",
        "",
        "Half of the particles are large: diameters of disks, or square roots of the rest areas of droplets, have the "
        "ratio 1.4 and the mean 1, the unit of length l. The box is square, periodic and of fixed shape.",
        "",
        "Two disks at the distance r, less than the mean s of their diameters, have the energy (eps/2)(1 - r/s)^2 in "
        "the files of onset and (k/2)(s - r)^2 in the files of a pressure. Droplets are polygons of area a and "
        "perimeter p with the energy gamma p + (ka/2)(a - a0)^2, and contacts (eps/2)(1 - d/delta)^2 of each vertex at "
        "a distance d below delta from the closest edge of another polygon. The group `parameters/force_law` holds all "
        "constants, and the rest areas a0; the attribute `units` of `parameters` is eps or k. Stresses and moduli are "
        "in units of eps/l^2 or k.",
        "",
        "## Layout",
        "",
        "HDF5 after H5MD 1.1. With h5py alone:",
        "",
        "```python",
        "import h5py",
        "",
        f'with h5py.File("{sets[0].name if sets else "disks-64-onset"}.h5") as file:',
        '    x = file["particles/all/position/value"][:, :, :2]  # (packings, sites, 2)',
        '    box = file["particles/all/box/edges/value"][:, :2, :2]  # rows are lattice vectors',
        '    sizes = file["parameters/diameters"][:]  # (disks,)',
        '    g = file["observables/g/value"][:]  # (packings,)',
        "```",
        "",
        "The sites of disks are their centres. The sites of droplets are vertices: droplet i has the vertices from "
        "`parameters/offsets[i]` up to `parameters/offsets[i + 1]`. Positions are not wrapped into the box.",
        "",
        "| observable | meaning |",
        "|---|---|",
        "| seed | of the random start |",
        *(f"| {name} | {QUANTITIES[name].words} |" for name in MEASURED),
        "",
        "## Provenance",
        "",
        *(f"* made {date} by jamlab at commit {each}" for each, date in made),
        *(f"* {each}" for each in sorted(set().union(*(_versions(folder / f"{one.name}.h5") for one in sets)))),
        "",
        "`python -m studies packings --check` compares the files with their SHA-256 in `MANIFEST.csv`, reads them, "
        "measures them and makes the first packing of each set again.",
        "",
        "## Licence",
        "",
        f"{LICENCE[0]}, {LICENCE[1]}. Cite jamlab as `CITATION.cff` says.",
    ]


def _versions(path: Path) -> set[str]:
    """Libraries with which the packings of a file were made."""
    made = [packing.provenance for packing in jamlab.read_all(path)]
    return {f"{name} {each[name]}" for each in made for name in versions() if name in each}


def _metadata(sets: Sequence[PackingSet], known: dict[str, dict[str, str]]) -> dict[str, Any]:
    """Properties that DataCite 4 asks for, but for the DOI, which the archive gives."""
    dates = sorted(row["date"] for row in known.values())
    count = sum(int(row["rows"]) for row in known.values())
    sizes = dict.fromkeys(f"{each.n} {each.kind}" for each in sets)
    subjects = ("jamming", "soft disks", "deformable droplets", "emulsions", "foams")
    return {
        "types": {"resourceTypeGeneral": "Dataset", "resourceType": "Packings"},
        "creators": [{"name": "The jamlab authors", "nameType": "Organizational"}],
        "titles": [{"title": TITLE}],
        "publicationYear": dates[-1][:4] if dates else None,
        "dates": [{"date": date, "dateType": "Created"} for date in sorted(set(dates))],
        "version": versions().get("jamlab"),
        "formats": ["application/x-hdf5"],
        "rightsList": [{"rightsIdentifier": LICENCE[0], "rightsUri": LICENCE[1]}],
        "descriptions": [
            {
                "descriptionType": "Abstract",
                "description": f"{count} jammed packings at energy minima, of {', '.join(sizes)}, from onset on.",
            }
        ],
        "subjects": [{"subject": each} for each in subjects],
    }
