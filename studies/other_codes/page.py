"""Times of packings: picture, and tables of `docs/explanation/accuracy.md`, which `python -m studies.other_codes.page`
writes.

The tables stand between `<!-- made: NAME -->` and `<!-- end -->`; a test compares them with the data that ship.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from jamlab.plotting import in_unit
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED, SKY
from jamlab.statistics.power_laws import fit_exponent
from jamlab.storage.atomic_file import atomic_file
from studies.ensemble_tables import EnsembleTables
from studies.other_codes.packing_generation import NAME
from studies.panels import Drawing, TextTable, drawing, label, scale
from studies.reference_data import open_tables
from studies.study import Study
from studies.tables import DATA, read_manifest

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "accuracy.md"
_MADE = re.compile(r"(?<=<!-- made: )(\w+)( -->\n).*?(?=<!-- end -->)", re.DOTALL)
_MODELS = {"sp": "disks", "dp": "droplets"}
_WORKS = {"onset": "onset of {}", "pressure": "{} at p = 10⁻³ k", "minimum": "one minimum of {}"}
CAPTION = "CPU time against N, for disks (left) and droplets (right). Arrows: cut off by a limit of time."
CONDITIONS = (
    ("jamlab", "An onset starts at φ = 0.2. Droplets take the place of disks."),
    (
        "all",
        "Each run stands beside a run of jamlab right before it, and ends after ten times its CPU time (JaxDEM with "
        "64 and 256 disks: thirty times).",
    ),
    (
        "JaxDEM",
        "Disks start from the same positions with the same law, time step, step of φ and neighbour list. Its "
        "search bisection_jam has its default tolerances: an energy of 10⁻¹⁶ per disk, φ to 10⁻¹⁰. Compiling is not "
        "counted. Its version of 29 June 2026 keeps the inverse of the first box and finds no contact; the measurement "
        "divides by the present box.",
    ),
    (
        "JaxDEM",
        "Droplets start 0.05 in φ below an onset of jamlab, from its polygons, with springs for edges and area. "
        "Line tension is left out, because bisection_jam needs an energy of zero below onset.",
    ),
    ("dpm", "Its own particles of 12 and 17 vertices, law and protocol from φ = 0.5; Ftol = 10⁻¹², Ptol = 10⁻⁷."),
    (
        "LAMMPS",
        "No search for onset. It minimises the same disks, and the same droplets by the styles of jamlab, 0.01 "
        "above onset.",
    ),
    ("jax-md", "No search for onset; its minima are in the study other-codes."),
)
_BESIDE = "onset beside "  # jamlab's own onsets right before those of another code
SIZES = (64, 256, 1024, 4096)  # of the table of the page
_SHORT = {"onset": "onset", "pressure": "p = 10⁻³ k", "minimum": "one minimum"}
_MARKS = {"onset": "o", "pressure": "s", "minimum": "^"}
_COLOURS = {"jamlab": BLACK, "JaxDEM": RED, "LAMMPS cg": BLUE, "LAMMPS fire": SKY, "dpm": GREEN}


def costs(tables: EnsembleTables) -> pd.DataFrame:
    """Rows of the table without those that stand beside other codes; `ratio`: over jamlab in the same task; `bound`:
    whether `seconds` is where a limit of time cut a run off. Several seeds of another code are one row: their mean."""
    table = tables.read(NAME)
    table["bound"] = table["seconds"].isna() & table["limit"].notna()
    table["seconds"] = table["seconds"].fillna(table["limit"])
    ours = table[table["code"] == "jamlab"].groupby("task")["seconds"].first()
    table["ratio"] = table["seconds"] / table["task"].map(ours)
    table = table[~table["work"].str.startswith(_BESIDE)]
    keys = ["work", "model", "n", "code"]
    of = table.groupby(keys, sort=False)
    merged = of.agg({"seconds": "mean", "ratio": "mean", "force": "max", "bound": "any", "note": "last"})
    merged["seeds"] = of["seeds"].sum()
    return merged.reset_index()


def made(tables: EnsembleTables) -> dict[str, str]:
    """Parts of the page by name."""
    found = costs(tables)
    known = read_manifest(DATA)[f"{NAME}.csv"]
    table = tables.read(NAME)
    versions = dict(table.drop_duplicates("code", keep="last")[["code", "version"]].to_numpy())
    codes = ", ".join(
        f"{code} {version}" for code, version in versions.items() if code not in ("jamlab", "LAMMPS fire")
    )
    machine = ", ".join(sorted(set(table["machine"])))
    said = f"{machine}, one core, {known['date']}, commit {known['commit'].split()[-1]}. Other codes: {codes}.\n"
    return {
        "machine": said.replace("LAMMPS cg", "LAMMPS"),
        "jamlab": _markdown(("work", *(f"*N* = {n}" for n in SIZES)), _of_sizes(found)),
    }


def _of_sizes(found: pd.DataFrame) -> Iterable[Sequence[str]]:
    """Times of jamlab, a row for each work that has three of the sizes."""
    ours = found[(found["code"] == "jamlab") & found["n"].isin(SIZES)]
    for (work, model), rows in ours.groupby(["work", "model"], sort=False):
        seconds = dict(zip(rows["n"], rows["seconds"], strict=True))
        if len(seconds) > 2:
            name = _WORKS[str(work)].format(_MODELS[str(model)])
            yield [name, *(_two_digits(seconds[n]) if n in seconds else "" for n in SIZES)]


def _of_jamlab(found: pd.DataFrame) -> Iterable[Sequence[str]]:
    ours = found[found["code"] == "jamlab"]
    for (work, model), rows in ours.groupby(["work", "model"], sort=False):
        rows = rows.sort_values("n")
        powers = [np.nan, *(np.diff(np.log(rows["seconds"])) / np.diff(np.log(rows["n"])))]
        for row, power in zip(rows.to_dict("records"), powers, strict=True):
            yield [
                _WORKS[str(work)].format(_MODELS[str(model)]),
                f"{row['n']}",
                f"{row['seeds']}",
                _two_digits(row["seconds"]),
                "" if np.isnan(power) else f"{power:.1f}",
                _power_of_ten(row["force"]),
            ]


def _of_others(found: pd.DataFrame) -> Iterable[Sequence[str]]:
    for row in found[found["code"] != "jamlab"].sort_values(["work", "model", "n"]).to_dict("records"):
        least = "> " if row["bound"] else ""
        note = re.sub(r"\s+", " ", str(row["note"])).strip()
        yield [
            _WORKS[row["work"]].format(_MODELS[row["model"]]),
            f"{row['n']}",
            row["code"],
            f"{least}{_two_digits(row['seconds'])}",
            f"{least}{_two_digits(row['ratio'])}",
            note,
        ]


def _two_digits(value: float) -> str:
    """A number with two digits or more, without a power of ten."""
    return f"{value:.0f}" if value >= 9.95 else f"{value:.2g}"


def _power_of_ten(value: float) -> str:
    """A number by its first digit, as prose writes it."""
    if not np.isfinite(value) or value == 0.0:
        return ""
    digit, _, exponent = f"{value:.0e}".partition("e")
    return f"{digit} × 10{f'{int(exponent)}'.translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def _markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n" + "".join(f"| {' | '.join(cells)} |\n" for cells in lines) + "\n"


def page(text: str, parts: dict[str, str]) -> str:
    """The text of the page with its parts renewed."""
    return _MADE.sub(lambda found: f"{found[1]}{found[2]}{parts[found[1]]}", text)


def draw(tables: EnsembleTables) -> Drawing:
    """Draw CPU time over N, disks and droplets side by side: a colour for each code, a mark for each work."""
    found = costs(tables)
    out, panels = drawing(NAME, 1, 2, 5.6, 5.6)
    for axes, (model, name) in zip(panels, _MODELS.items(), strict=True):
        scale(axes)
        axes.margins(0.1, 0.12)
        for (work, text), code in product(_SHORT.items(), _COLOURS):
            rows = found[(found["model"] == model) & (found["work"] == work) & (found["code"] == code)].sort_values("n")
            if rows.empty:
                continue
            look: dict[str, Any] = {"color": _COLOURS[code], "marker": _MARKS[work], "markersize": 6.5}
            look |= {"linestyle": "-" if code == "jamlab" else "--"}
            look |= (
                {"fillstyle": "none", "markersize": 10} if code == "dpm" else {}
            )  # another may lie at the same place
            known = len(rows) > 2 and not rows["bound"].any()
            n, seconds = (rows[column].to_numpy(dtype=np.float64) for column in ("n", "seconds"))
            power = f", ~ $N^{{{fit_exponent(n, seconds):.1f}}}$" if known else ""
            out.curve(axes, f"{code}, {work}", n, seconds, label=f"{code}: {text}{power}", **look)
            for place in np.column_stack([n, seconds])[rows["bound"].to_numpy()]:
                up: dict[str, Any] = {"arrowstyle": "<-", "color": look["color"], "linewidth": 1.8}
                axes.annotate("", place, xytext=(0, 24), textcoords="offset points", arrowprops=up)
        below: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14), "ncols": 2, "frameon": False}
        label(axes, "number of particles $N$", in_unit("CPU time on one core", "s"), **below)
        axes.set_title(name, fontsize=11)
    out.caption = CAPTION
    heads = ("work", "N", "code", "CPU time, s", "over jamlab's", "note")
    ours = ("work", "N", "seeds", "CPU time, s", "power of N", "largest force")
    out.text = [
        TextTable(heads, [[*row] for row in _of_others(found)], "Other codes", words=True),
        TextTable(ours, [[*row] for row in _of_jamlab(found)], "jamlab; power of N from the row before", words=True),
        TextTable(("code", "conditions"), CONDITIONS, words=True),
    ]
    return out


STUDY = Study(NAME, "What a packing costs here and in other codes, against N", {}, draw)


if __name__ == "__main__":
    renewed = page(PAGE.read_text(encoding="utf-8"), made(open_tables()))
    with atomic_file(PAGE) as path:
        path.write_text(renewed, encoding="utf-8")
