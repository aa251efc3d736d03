"""Versions of protocols and of definitions, so that a table never mixes two of them.

The module that owns a protocol or a definition holds its version, a whole number. Whoever changes what it gives, for
the same parameters and beyond rounding, raises that number by one. Protocols enter the names of states and of tasks,
definitions those of tasks: after a raise, tasks are made again, or measured again on the packings that are stored. A
file without versions was written before there were any: it has 1 of each, which enters no name.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from jamlab.flow import creep, flow_curve, oscillate
from jamlab.geometry import contact_network, orientational_order, packing_fraction, particle_shape
from jamlab.geometry.voids import voids
from jamlab.mechanics import elasticity, slow_shear
from jamlab.protocols import compression, onset, relaxation, size_distributions, target_pressure
from jamlab.rheology import complex_modulus, displacement_correlation, mode_motion

FIRST = 1  # version of what was stored before versions were

_VERSIONS: dict[str, Callable[[], int]] = {
    # protocols
    "onset of disks": lambda: onset.ONSET_PROTOCOL["sp"],
    "onset of stiffening disks": lambda: onset.ONSET_PROTOCOL["stiffening"],
    "onset of droplets": lambda: onset.ONSET_PROTOCOL["dp"],
    "compression of disks": lambda: compression.COMPRESSION_PROTOCOL["sp"],
    "compression of droplets": lambda: compression.COMPRESSION_PROTOCOL["dp"],
    "pressure": lambda: target_pressure.PRESSURE_PROTOCOL,
    "quench": lambda: relaxation.QUENCH_PROTOCOL,
    "sizes": lambda: size_distributions.SIZES_PROTOCOL,
    # definitions
    "contacts": lambda: contact_network.CONTACTS_DEFINITION,
    "packing fraction": lambda: packing_fraction.FRACTION_DEFINITION,
    "shapes": lambda: particle_shape.SHAPE_DEFINITION,
    "voids": lambda: voids.VOIDS_DEFINITION,
    "order": lambda: orientational_order.ORDER_DEFINITION,
    "moduli": lambda: elasticity.MODULI_DEFINITION,
    "slow shear": lambda: slow_shear.SLOW_SHEAR_DEFINITION,
    "spectra": lambda: complex_modulus.SPECTRUM_DEFINITION,
    "correlation": lambda: displacement_correlation.CORRELATION_DEFINITION,
    "modes": lambda: mode_motion.MODES_DEFINITION,
    "flow": lambda: flow_curve.FLOW_DEFINITION,
    "oscillation": lambda: oscillate.OSCILLATION_DEFINITION,
    "creep": lambda: creep.CREEP_DEFINITION,
}
STATES_BY = ("contacts", "packing fraction", "shapes", "voids", "moduli")  # definitions of the columns of "states"

Versions = dict[str, int]  # name -> version, of those above 1


def raised(names: Iterable[str]) -> Versions:
    """Versions of today of some protocols or definitions, those above 1."""
    return {name: found for name in sorted(names) if (found := _VERSIONS[name]()) != FIRST}


def as_column(names: Iterable[str], versions: Mapping[str, int]) -> str:
    """Versions as the value of a column, such as "contacts=2; moduli=1"."""
    return "; ".join(f"{name}={versions.get(name, FIRST)}" for name in sorted(names))


def unlike(values: Iterable[Any]) -> list[str]:
    """Names that have several versions in a column; a row without versions is from before there were any."""
    several: dict[str, set[str]] = {}
    values = list(values)
    for text in values:
        for part in text.split("; ") if isinstance(text, str) and text else ():
            name, version = part.split("=")
            several.setdefault(name, set()).add(version)
    if not all(isinstance(text, str) for text in values):
        several = {name: found | {str(FIRST)} for name, found in several.items()}
    return [name for name, found in several.items() if len(found) > 1]


def changes(then: Mapping[str, int], now: Mapping[str, int]) -> list[str]:
    """What differs between the versions of a file and those of today, as text."""
    names = sorted(then.keys() | now.keys())
    pairs = [(name, then.get(name, FIRST), now.get(name, FIRST)) for name in names]
    return [f"{name} {before}, now {after}" for name, before, after in pairs if before != after]
