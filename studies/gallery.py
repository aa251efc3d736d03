"""Figures of the papers and beside them, as studies: each is drawn from tables of campaigns, with its verdicts."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

import pandas as pd

from jamlab.campaign.campaign import Campaign, open_campaign
from jamlab.checks import name_meant
from jamlab.errors import InputError
from jamlab.figures.explorer.write_page import explorer_assets
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import atomic_file
from studies import micrograph_errors, study
from studies.baumgarten import correlation, motion, spectra
from studies.baumgarten import pictures as drawings
from studies.beyond import droplet_modes, droplet_sizes, droplet_structure, stiffening_disks
from studies.boromand import confluence, contacts_and_modulus, geometry, onset, pictures, voids
from studies.boromand import tables as coefficients
from studies.claims import SUMMARY, Claim, first_line, summary
from studies.dynamics import collapse, flow_curves
from studies.ensemble_tables import EnsembleTables
from studies.html_page import Section
from studies.panels import Drawing
from studies.reference_data import reference_tables
from studies.study import CampaignStudy, Failure, Page, Plan, Shown, write_csv, write_page

FIGURES: dict[str, Callable[[EnsembleTables], Drawing]] = {
    "boromand-1": pictures.figure_1,
    "boromand-2": pictures.figure_2,
    "boromand-3": pictures.figure_3,
    "boromand-4": geometry.figure_4,
    "boromand-5": contacts_and_modulus.figure_5,
    "boromand-6": contacts_and_modulus.figure_6,
    "boromand-7": confluence.figure_7,
    "boromand-8": voids.figure_8,
    "boromand-8-voids": pictures.figure_8_snapshots,
    "boromand-9": confluence.figure_9,
    "boromand-10": onset.figure_10,
    "boromand-11": geometry.figure_11,
    "tables": coefficients.tables_1_2,
    "baumgarten-1": spectra.figure_1,
    "baumgarten-1-fields": drawings.figure_1_fields,
    "baumgarten-2": drawings.figure_2,
    "baumgarten-3": spectra.figure_3,
    "baumgarten-4": spectra.figure_4,
    "baumgarten-5": motion.figure_5,
    "baumgarten-6": spectra.figure_6,
    "baumgarten-7": correlation.figure_7,
    "baumgarten-8": motion.figure_8,
    "dynamics-flow-curves": flow_curves.flow_curves,
    "dynamics-collapse": collapse.flow_collapse,
    "dynamics-overshoot": flow_curves.overshoot,
    "dynamics-yield": flow_curves.yield_stress,
    "dynamics-amplitudes": flow_curves.amplitude_sweeps,
    "dynamics-power-law": collapse.power_law_collapse,
    "dynamics-equivalent-damping": flow_curves.equivalent_damping,
    "dynamics-droplets": flow_curves.droplets_beside_disks,
    "beyond-droplet-spectra": droplet_modes.droplet_spectra,
    "beyond-droplet-modes": droplet_modes.droplet_modes,
    "beyond-droplet-contacts": droplet_structure.droplet_contacts,
    "beyond-droplet-sizes": droplet_sizes.droplet_sizes,
    "beyond-droplet-vertices": droplet_sizes.droplet_vertices,
    "beyond-droplet-voids": droplet_structure.droplet_voids,
    "beyond-stiffening-disks": stiffening_disks.stiffening_disks,
    "micrograph-errors": micrograph_errors.micrograph_errors,
}
_PAGE = "figures"
PAGE = f"{_PAGE}.html"
VERDICTS = "verdicts.csv"


def file_names(names: Iterable[str], *, whole: bool) -> list[str]:
    """Names of the files that are written of figures; `whole`: with their page, verdicts and summary."""
    return study.file_names(names, _PAGE if whole else "") + ([VERDICTS, SUMMARY] if whole else [])


def titles() -> dict[str, str]:
    """Name of each figure -> what it shows, in one line."""
    return {name: " ".join((f.__doc__ or "").split()).partition(". ")[0].rstrip(".") for name, f in FIGURES.items()}


def check_names(names: Sequence[str]) -> list[str]:
    """Names of the figures asked for; "all" stands for every one."""
    unknown = [name for name in names if name not in FIGURES and name != "all"]
    if unknown or not names:
        hint = name_meant(" ".join(unknown[:1]), FIGURES, otherwise=f"use all, or {', '.join(FIGURES)}")
        raise InputError(f"no figure {', '.join(unknown) or 'named'}: {hint}")
    return list(FIGURES) if "all" in names else list(dict.fromkeys(names))


def draw(name: str, tables: EnsembleTables) -> Drawing:
    """Draw one figure."""
    try:
        drawing = FIGURES[name](tables)
    except KeyError as error:
        raise InputError(
            f"{name} needs the column {error}, which the tables lack: use tables of this version"
        ) from None
    drawing.name = name
    return drawing


def draw_shown(name: str, tables: EnsembleTables) -> Shown:
    """Draw one figure as what a study shows."""
    d = draw(name, tables)
    return Shown(d.figure, d.caption, (), d.table, d.claims, d.numbers, d.name)


@dataclass(frozen=True)
class FigureStudy(CampaignStudy):
    """A figure that is drawn from the tables of a campaign."""

    made_by: str  # name of the campaign, one of those that ship; empty: a table that ships is all that it draws
    kind: ClassVar[str] = "figure"

    @property
    def heading(self) -> str:
        return f"{self.name}: {self.title}"

    def draw(self, folder: Path | None = None) -> Shown:
        if folder is None or not self.made_by:
            return draw_shown(self.name, reference_tables())
        return draw_shown(self.name, EnsembleTables(self.campaign(folder).table))

    def plan(self, folder: Path) -> Plan:
        return super().plan(folder) if self.made_by else Plan(self.name, 0, 0.0)

    def run(self, folder: Path, progress: Progress = no_progress, *, workers: int | None = None) -> None:
        if self.made_by:
            super().run(folder, progress, workers=workers)

    def campaign(self, folder: Path) -> Campaign:
        """Open the campaign, which other figures share."""
        file = Path(__file__).parent / "campaigns" / f"{self.made_by}.toml"
        return open_campaign(file, folder / self.made_by)


# by the first letters of a figure; reference: all others
_CAMPAIGNS = {"dynamics-": "dynamics", "beyond-": "beyond_the_papers", "micrograph-errors": ""}


def studies() -> list[FigureStudy]:
    """All figures as studies."""
    return [
        FigureStudy(name, title, next((c for start, c in _CAMPAIGNS.items() if name.startswith(start)), "reference"))
        for name, title in titles().items()
    ]


def write_all(
    names: Sequence[str],
    tables: EnsembleTables,
    folder: Path,
    progress: Progress = no_progress,
    opening: Sequence[Section] = (),
    processes: int = 1,
) -> tuple[list[Shown], list[Failure]]:
    """Write figures, the table of verdicts, their summary and one self-contained HTML page, see `write_page`."""
    headings = {study.name: study.heading for study in studies()}
    drawn, failures = write_page(
        folder,
        Page(_PAGE, "Figures of both papers", _lead, each=True, assets=explorer_assets()),
        {name: headings[name] for name in names},
        partial(draw_shown, tables=tables),
        tables.facts,
        opening=opening,
        progress=progress,
        processes=processes,
    )
    claims = [c for each in drawn for c in each.claims]
    write_csv(folder / VERDICTS, pd.DataFrame([c.row() for c in claims]))
    with atomic_file(folder / SUMMARY) as temporary:
        temporary.write_text("\n".join(summary(claims, every=True)) + "\n", encoding="utf-8")
    return drawn, failures


def _lead(claims: Sequence[Claim]) -> str:
    return (
        f"Figures of Boromand et al. and of Baumgarten & Tighe from our own packings. {first_line(claims)} One rule "
        "for every number: what our data allow is its 95 % interval over packings, of which it takes five, and that "
        "of every member of the family of other defensible windows, sizes and offsets; what the paper's words mean is "
        "its value within its margin: the error it states, half a unit of its last digit, or what its words allow. A "
        "number agrees if each interval lies within the second, differs if all lie beyond it on one side, and is "
        "undecided else. Where a number differs, the cause stands beside it with the figure that shows it. Where the "
        "paper contradicts itself, the contradiction does. Calibrated numbers are no independent test. "
        f"Contents and choices count all {len(claims)} rows, also those not counted here and those of figures that "
        "neither paper has."
    )
