"""All studies by name: charts of cost against error, stability maps, figures, comparisons."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

from jamlab.checks import check_choice
from studies.beyond import foams, jamming, polydispersity
from studies.cost import measurements, minimisers, packings, size_scaling
from studies.cost.chart import Chart
from studies.droplet_calibration import DropletCalibration
from studies.failure import disks, droplets, dynamics, elastic_moduli
from studies.failure.map import Map
from studies.gallery import FigureStudy
from studies.gallery import studies as figures
from studies.other_codes.compare import Comparison
from studies.study import Study

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


def studies() -> dict[str, Study]:
    """All studies by name."""
    return {**FIGURES, **CHARTS, **MAPS, **OTHERS}


def chosen(studies: Mapping[str, S], names: Sequence[str], what: str = "") -> dict[str, S]:
    """Studies of these names, all if none is given; `what` they are, by default their kind."""
    for name in names:
        check_choice(what or next(iter(studies.values())).kind, name, studies)
    return {name: studies[name] for name in names or studies}
