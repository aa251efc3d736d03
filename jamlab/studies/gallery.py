"""Figures of the papers and beside them, as studies: each is drawn from tables of campaigns, with its verdicts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from importlib import resources
from pathlib import Path
from typing import ClassVar

import pandas as pd

from jamlab.campaign.campaign import Campaign, open_campaign
from jamlab.errors import InputError
from jamlab.figures.explorer.write_page import explorer_assets
from jamlab.figures.html_page import Section, write_csv
from jamlab.processes.progress import Progress, no_progress
from jamlab.storage.atomic_file import atomic_file
from jamlab.studies import micrograph_errors
from jamlab.studies.baumgarten import correlation as baumgarten_correlation
from jamlab.studies.baumgarten import motion as baumgarten_motion
from jamlab.studies.baumgarten import pictures as baumgarten_pictures
from jamlab.studies.baumgarten import spectra as baumgarten_spectra
from jamlab.studies.beyond import droplet_contacts as beyond_droplet_contacts
from jamlab.studies.beyond import droplet_modes as beyond_droplet_modes
from jamlab.studies.beyond import droplet_sizes as beyond_droplet_sizes
from jamlab.studies.beyond import droplet_spectra as beyond_droplet_spectra
from jamlab.studies.beyond import droplet_vertices as beyond_droplet_vertices
from jamlab.studies.beyond import droplet_voids as beyond_droplet_voids
from jamlab.studies.beyond import stiffening_disks as beyond_stiffening_disks
from jamlab.studies.boromand import confluence as boromand_confluence
from jamlab.studies.boromand import contacts_and_modulus as boromand_contacts_and_modulus
from jamlab.studies.boromand import geometry as boromand_geometry
from jamlab.studies.boromand import onset as boromand_onset
from jamlab.studies.boromand import pictures as boromand_pictures
from jamlab.studies.boromand import power_laws as boromand_power_laws
from jamlab.studies.boromand import tables as boromand_tables
from jamlab.studies.boromand import voids as boromand_voids
from jamlab.studies.claims import SUMMARY, Claim, first_line, summary
from jamlab.studies.dynamics import amplitudes as dynamics_amplitudes
from jamlab.studies.dynamics import collapse as dynamics_collapse
from jamlab.studies.dynamics import equivalent_damping as dynamics_equivalent_damping
from jamlab.studies.dynamics import flow_curves as dynamics_flow_curves
from jamlab.studies.dynamics import power_law as dynamics_power_law
from jamlab.studies.dynamics import yielding as dynamics_yield
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.page import Failure, Page, write_files, write_page
from jamlab.studies.panels import Drawing
from jamlab.studies.reference_data import reference_tables
from jamlab.studies.study import CampaignStudy, Shown

FIGURES: dict[str, Callable[[EnsembleTables], Drawing]] = {
    "boromand-1": boromand_pictures.figure_1,
    "boromand-2": boromand_pictures.figure_2,
    "boromand-3": boromand_pictures.figure_3,
    "boromand-4": boromand_geometry.figure_4,
    "boromand-5": boromand_contacts_and_modulus.figure_5,
    "boromand-6": boromand_contacts_and_modulus.figure_6,
    "boromand-7": boromand_confluence.figure_7,
    "boromand-8": boromand_voids.figure_8,
    "boromand-8-voids": boromand_pictures.figure_8_snapshots,
    "boromand-9": boromand_geometry.figure_9,
    "boromand-10": boromand_onset.figure_10,
    "boromand-11": boromand_power_laws.figure_11,
    "tables": boromand_tables.tables_1_2,
    "baumgarten-1": baumgarten_spectra.figure_1,
    "baumgarten-1-fields": baumgarten_pictures.figure_1_fields,
    "baumgarten-2": baumgarten_pictures.figure_2,
    "baumgarten-3": baumgarten_spectra.figure_3,
    "baumgarten-4": baumgarten_spectra.figure_4,
    "baumgarten-5": baumgarten_motion.figure_5,
    "baumgarten-6": baumgarten_spectra.figure_6,
    "baumgarten-7": baumgarten_correlation.figure_7,
    "baumgarten-8": baumgarten_motion.figure_8,
    "dynamics-flow-curves": dynamics_flow_curves.flow_curves,
    "dynamics-collapse": dynamics_collapse.flow_collapse,
    "dynamics-overshoot": dynamics_yield.overshoot,
    "dynamics-yield": dynamics_yield.yield_stress,
    "dynamics-amplitudes": dynamics_amplitudes.amplitude_sweeps,
    "dynamics-power-law": dynamics_power_law.power_law_collapse,
    "dynamics-equivalent-damping": dynamics_equivalent_damping.equivalent_damping,
    "dynamics-droplets": dynamics_flow_curves.droplets_beside_disks,
    "beyond-droplet-spectra": beyond_droplet_spectra.droplet_spectra,
    "beyond-droplet-modes": beyond_droplet_modes.droplet_modes,
    "beyond-droplet-contacts": beyond_droplet_contacts.droplet_contacts,
    "beyond-droplet-sizes": beyond_droplet_sizes.droplet_sizes,
    "beyond-droplet-vertices": beyond_droplet_vertices.droplet_vertices,
    "beyond-droplet-voids": beyond_droplet_voids.droplet_voids,
    "beyond-stiffening-disks": beyond_stiffening_disks.stiffening_disks,
    "micrograph-errors": micrograph_errors.micrograph_errors,
}
_PAGE = "figures"
PAGE = f"{_PAGE}.html"
VERDICTS = "verdicts.csv"


def titles() -> dict[str, str]:
    """Name of each figure -> what it shows, in one line."""
    return {name: (function.__doc__ or "").splitlines()[0].rstrip(".") for name, function in FIGURES.items()}


def check_names(names: Sequence[str]) -> list[str]:
    """Names of the figures asked for; "all" stands for every one.

    Raises:
        InputError: an unknown name.
    """
    unknown = [name for name in names if name not in FIGURES and name != "all"]
    if unknown or not names:
        meant = [found for name in unknown for found in get_close_matches(name, FIGURES, 1)]
        guess = f"did you mean {', '.join(meant)}? " if meant else ""
        raise InputError(f"no figure {', '.join(unknown) or 'named'}: {guess}Use all, or {', '.join(FIGURES)}")
    return list(FIGURES) if "all" in names else list(dict.fromkeys(names))


def draw(name: str, tables: EnsembleTables) -> Drawing:
    """Draw one figure.

    Raises:
        InputError: the tables lack the data of the figure.
        StorageError: a table cannot be read.
    """
    try:
        drawing = FIGURES[name](tables)
    except KeyError as error:
        raise InputError(
            f"{name} needs the column {error}, which the tables lack: use tables of this version"
        ) from None
    drawing.name = name
    return drawing


def write(drawing: Drawing, folder: Path) -> tuple[list[Path], bytes | None]:
    """Write PNG, PDF and CSV of a figure; returns their paths and the PNG itself.

    Raises:
        StorageError: the folder cannot be written.
    """
    return write_files(drawing.name, _shown(drawing), folder)


def _shown(drawing: Drawing) -> Shown:
    return Shown(drawing.figure, drawing.caption, (), drawing.table, drawing.claims, drawing.numbers)


def _draw_shown(name: str, tables: EnsembleTables) -> Shown:
    return _shown(draw(name, tables))


@dataclass(frozen=True)
class FigureStudy(CampaignStudy):
    """A figure that is drawn from the tables of a campaign.

    Attributes:
        made_by: name of the campaign, one of those that ship.
    """

    made_by: str
    kind: ClassVar[str] = "figure"

    @property
    def heading(self) -> str:
        """Name and title."""
        return f"{self.name}: {self.title}"

    def draw(self, folder: Path | None = None) -> Shown:
        """Draw the figure from a folder of results, or from the reference data that ship."""
        tables = reference_tables() if folder is None else EnsembleTables(self.campaign(folder).table)
        return _draw_shown(self.name, tables)

    def campaign(self, folder: Path) -> Campaign:
        """Open the campaign, which other figures share."""
        file = Path(str(resources.files("jamlab.campaign"))) / f"{self.made_by}.toml"
        return open_campaign(file, folder / self.made_by)


_CAMPAIGNS = {"dynamics-": "dynamics", "beyond-": "beyond_the_papers"}  # reference: all others


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
    """Write figures, the table of verdicts, their summary and one self-contained HTML page.

    Args:
        names: of figures.
        tables: to draw from; they can be pickled where there are several processes.
        folder: made if it is not there.
        progress: called before each figure.
        opening: sections before those of the figures, such as those of `example_packings`.
        processes: that draw side by side.

    Returns:
        What was drawn, and what could not be.

    Raises:
        StorageError: the folder cannot be written.
        InputError: no figure could be drawn.
    """
    headings = {study.name: study.heading for study in studies()}
    drawn, failures = write_page(
        folder,
        Page(_PAGE, "Figures of both papers", _lead, each=True, assets=explorer_assets()),
        {name: headings[name] for name in names},
        partial(_draw_shown, tables=tables),
        tables.facts,
        opening=opening,
        progress=progress,
        processes=processes,
    )
    claims = [c for each in drawn for c in each.claims]
    write_csv(folder / VERDICTS, pd.DataFrame([c.row() for c in claims]))
    with atomic_file(folder / SUMMARY) as temporary:
        temporary.write_text("\n".join(summary(claims)) + "\n", encoding="utf-8")
    return drawn, failures


def _lead(claims: Sequence[Claim]) -> str:
    return (
        f"Figures of Boromand et al. and of Baumgarten & Tighe from our own packings. {first_line(claims)} A number "
        "agrees if its 95 % interval over packings, of which it takes five, meets the paper's value within the paper's "
        "own margin: the error it states, half a unit of its last digit, or what its words allow; and if half the "
        "interval is at most a quarter of that value (of A - 1, of the distance to onset), so that it could have "
        "disagreed; else it is undecided. Where a number differs, the cause stands beside it with the figure that "
        "shows it. Where the paper contradicts itself, the contradiction does. Calibrated numbers are no independent "
        "test."
    )
