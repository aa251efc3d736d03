"""All studies by name: charts of cost against error, stability maps, figures, comparisons, and those of users."""

import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TypeVar

from jamlab.checks import check_choice
from jamlab.errors import InputError
from jamlab.storage.atomic_file import atomic_file
from jamlab.studies.beyond import foams, jamming, polydispersity
from jamlab.studies.cost import measurements, minimisers, packings, size_scaling
from jamlab.studies.cost.chart import Chart
from jamlab.studies.droplet_calibration import DropletCalibration
from jamlab.studies.failure import disks, droplets, dynamics, elastic_moduli
from jamlab.studies.failure.map import Map
from jamlab.studies.gallery import FigureStudy
from jamlab.studies.gallery import studies as figures
from jamlab.studies.other_codes.compare import Comparison
from jamlab.studies.study import Study

S = TypeVar("S", bound=Study)


def _by_name(studies: Iterable[S]) -> dict[str, S]:
    return {study.name: study for study in studies}


CHARTS: Mapping[str, Chart] = _by_name(
    [
        *(minimisers.DISKS, minimisers.DROPLETS, packings.ONSET, packings.PRESSURE),
        *(measurements.FRACTIONS, measurements.SHEAR_MODULUS, measurements.SPECTRUM, measurements.DROPLET_SPECTRUM),
        *(packings.VERTICES, measurements.INERTIA, measurements.SOLVERS, packings.MEANS, minimisers.CODES),
    ]
)
_MAPS = (disks, elastic_moduli, droplets, dynamics)
MAPS: Mapping[str, Map] = _by_name(study for room in _MAPS for study in room.MAPS)


OTHERS: Mapping[str, Study] = _by_name(
    [
        *(Comparison(), size_scaling.STUDY, DropletCalibration(), polydispersity.STUDY),
        *(jamming.ELASTICITY, jamming.ONSET, jamming.PROTOCOLS, foams.CRYSTAL, foams.FOAM_OF_OTHERS),
    ]
)
FIGURES: Mapping[str, FigureStudy] = _by_name(figures())
OWN = "jamlab-studies.txt"  # lists files with studies of users, in the working folder


def studies(folder: Path = Path()) -> dict[str, Study]:
    """All studies by name, those of users in a working folder last."""
    found: dict[str, Study] = {**FIGURES, **CHARTS, **MAPS, **OTHERS}
    file = folder / OWN
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        for study in read_studies(folder / line):
            if study.name in found:
                raise InputError(f"{line}: the name {study.name!r} is taken: give the study another one")
            found[study.name] = study
    return found


def read_studies(file: Path) -> list[Study]:
    """Import a Python file and collect its studies."""
    spec = spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None or not file.is_file():
        raise InputError(f"{file} is no Python file: give one that defines studies")
    module = module_from_spec(spec)
    sys.modules[file.stem] = module  # by which dataclasses and other processes find what it defines
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{file} cannot be imported: {type(error).__name__}: {error}") from error
    found = [value for value in vars(module).values() if isinstance(value, Study)]
    if not found:
        raise InputError(f"{file} defines no study: make one, such as STUDY = MyStudy(name, title)")
    return found


def add_studies(file: Path, folder: Path = Path()) -> list[Study]:
    """Add the studies of a Python file to those of a working folder."""
    known, found, own = studies(folder), read_studies(file), folder / OWN
    for study in found:
        if study.name in known:
            raise InputError(f"the name {study.name!r} is taken: give the study of {file} another one")
    before = own.read_text(encoding="utf-8") if own.exists() else ""
    with atomic_file(own) as temporary:
        temporary.write_text(f"{before}{os.path.relpath(file, folder)}\n", encoding="utf-8")
    return found


def chosen(studies: Mapping[str, S], names: Sequence[str], what: str = "") -> dict[str, S]:
    """Studies of these names, all if none is given; `what` they are, by default their kind."""
    for name in names:
        check_choice(what or next(iter(studies.values())).kind, name, studies)
    return {name: studies[name] for name in names or studies}
