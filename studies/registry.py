"""All studies by name, in the groups that are drawn on one page."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

from jamlab.checks import check_choice
from studies import beyond
from studies.dynamics import collapse, flow_curves, flow_layers
from studies.ensemble_tables import EnsembleTables
from studies.other_codes import page as packing_generation
from studies.panels import Drawing
from studies.papers.baumgarten import motion, spectra
from studies.papers.boromand import contacts_and_modulus, geometry, onset_and_confluence, pictures, voids
from studies.speed_accuracy import (
    droplet_vertices,
    ensemble_means,
    flow,
    moduli,
    other_codes,
    packing_fractions,
    packings,
    size_scaling,
)
from studies.speed_accuracy.chart import LEAD as LEAD_OF_CHARTS
from studies.speed_accuracy.chart import Chart
from studies.stability import flow as flow_of_maps
from studies.stability import moduli as moduli_of_maps
from studies.stability import packings as packings_of_maps
from studies.stability.map import LEAD as LEAD_OF_MAPS
from studies.stability.map import Map
from studies.study import Group, Study


def _figures(functions: Mapping[str, Callable[[EnsembleTables], Drawing]]) -> tuple[Study, ...]:
    """Studies that are drawn from tables of campaigns; their titles stand in the docstrings of the functions."""
    titles = {name: (inspect.getdoc(draw) or "").split("\n\n")[0] for name, draw in functions.items()}
    return tuple(Study(name, " ".join(titles[name].split()).rstrip("."), {}, draw) for name, draw in functions.items())


PAPERS = _figures(
    {
        "boromand-2": pictures.figure_2,
        "boromand-4": geometry.figure_4,
        "boromand-5": contacts_and_modulus.figure_5,
        "boromand-6": contacts_and_modulus.figure_6,
        "boromand-7": onset_and_confluence.figure_7,
        "boromand-8": voids.figure_8,
        "boromand-8-voids": pictures.figure_8_snapshots,
        "boromand-8-laws": voids.droplet_laws,
        "boromand-9": onset_and_confluence.figure_9,
        "boromand-10": onset_and_confluence.figure_10,
        "boromand-11": geometry.figure_11,
        "tables": contacts_and_modulus.tables_1_2,
        "baumgarten-1": spectra.figure_1,
        "baumgarten-1-fields": spectra.figure_1_fields,
        "baumgarten-3": spectra.figure_3,
        "baumgarten-4": spectra.figure_4,
        "baumgarten-5": motion.figure_5,
        "baumgarten-6": spectra.figure_6,
        "baumgarten-7": motion.figure_7,
        "baumgarten-8": motion.figure_8,
        **flow_curves.FIGURES,
        **collapse.FIGURES,
    }
)


def _of_folder(folder: ModuleType) -> Iterator[Study]:
    """Studies of all files of a folder: `STUDY`, `STUDIES` or `FIGURES` of each."""
    for file in sorted(each.name for each in iter_modules(folder.__path__)):
        module = import_module(f"{folder.__name__}.{file}")
        yield from getattr(module, "STUDIES", ())
        yield from [module.STUDY] if hasattr(module, "STUDY") else []
        yield from _figures(getattr(module, "FIGURES", {}))


BEYOND = tuple(_of_folder(beyond))
_FILES = (packings, packing_fractions, moduli, droplet_vertices, flow, ensemble_means, other_codes)
CHARTS: dict[str, Chart] = {each.name: each for file in _FILES for each in file.CHARTS}
MAPS: dict[str, Map] = {
    each.name: each for file in (packings_of_maps, moduli_of_maps, flow_of_maps) for each in file.MAPS
}


_OVER_SIZE = (packing_generation.STUDY, size_scaling.STUDY)
GROUPS = {  # by name, which is also the name of their page
    "papers": Group(
        "Figures of both papers",
        "Figures of Boromand et al. and of Baumgarten & Tighe from our own packings.",
        PAPERS,
        overview=True,
    ),
    "beyond": Group("Beyond the papers", "What other laws of jamming and of foams say.", BEYOND),
    "speed-accuracy": Group(
        "Cost against error",
        LEAD_OF_CHARTS,
        [*(each.study for each in CHARTS.values()), flow_layers.STUDY, packing_generation.STUDY, size_scaling.STUDY],
        1,
    ),
    "stability": Group("Where methods fail", LEAD_OF_MAPS, [each.study for each in MAPS.values()], 2),
}
STUDIES = {study.name: study for group in GROUPS.values() for study in group.studies}


def chosen(names: list[str]) -> dict[str, Group]:
    """Groups of these names; "all" stands for every one, and names of studies are a group of their own."""
    for name in names:
        check_choice("study", name, ["all", *GROUPS, *STUDIES])
    found = {name: group for name, group in GROUPS.items() if name in names or "all" in names}
    single = [STUDIES[name] for name in dict.fromkeys(names) if name in STUDIES]
    if single:
        found["studies"] = Group("Studies", "; ".join(study.title for study in single) + ".", single)
    return found
