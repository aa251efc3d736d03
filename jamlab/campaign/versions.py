"""Versions of protocols and of definitions, so that a table never mixes two of them.

The module that owns a protocol or a definition holds its version, a whole number. Whoever changes what it gives, for
the same parameters and beyond rounding, raises that number by one. Protocols enter the names of states and of tasks,
definitions those of tasks: after a raise, tasks are made again, or measured again on the packings that are stored. A
file without versions was written before there were any: it has 1 of each, which enters no name.
"""

from collections.abc import Iterable, Mapping

from jamlab.flow import creep, flow_curve, oscillate
from jamlab.geometry import contact_network, orientational_order, packing_fraction, particle_shape
from jamlab.geometry.voids import voids
from jamlab.mechanics import elasticity, slow_shear
from jamlab.models.models import MODELS
from jamlab.protocols import compression, onset, relaxation, size_distributions, target_pressure
from jamlab.rheology import complex_modulus, displacement_correlation, mode_motion

FIRST = 1  # version of what was stored before versions were
STATES_BY = ("contacts", "packing fraction", "shapes", "voids", "moduli")  # definitions of the columns of "states"
Versions = dict[str, int]  # name -> version, of those above 1


def _today() -> dict[str, int]:
    """Versions of the protocols, then of the definitions."""
    models = [(model.descent, model.particles) for model in MODELS.values()]
    return {
        **{f"onset of {particles}": onset.ONSET_PROTOCOL[name] for name, particles in models},
        "onset of stiffening disks": onset.ONSET_PROTOCOL["stiffening"],
        **{f"compression of {particles}": compression.COMPRESSION_PROTOCOL[name] for name, particles in models},
        "pressure": target_pressure.PRESSURE_PROTOCOL,
        "quench": relaxation.QUENCH_PROTOCOL,
        "sizes": size_distributions.SIZES_PROTOCOL,
        "contacts": contact_network.CONTACTS_DEFINITION,
        "packing fraction": packing_fraction.FRACTION_DEFINITION,
        "shapes": particle_shape.SHAPE_DEFINITION,
        "voids": voids.VOIDS_DEFINITION,
        "order": orientational_order.ORDER_DEFINITION,
        "moduli": elasticity.MODULI_DEFINITION,
        "slow shear": slow_shear.SLOW_SHEAR_DEFINITION,
        "spectra": complex_modulus.SPECTRUM_DEFINITION,
        "correlation": displacement_correlation.CORRELATION_DEFINITION,
        "modes": mode_motion.MODES_DEFINITION,
        "flow": flow_curve.FLOW_DEFINITION,
        "oscillation": oscillate.OSCILLATION_DEFINITION,
        "creep": creep.CREEP_DEFINITION,
    }


def raised(names: Iterable[str]) -> Versions:
    """Versions of today of some protocols or definitions, those above 1."""
    today = _today()
    return {name: today[name] for name in sorted(names) if today[name] != FIRST}


def as_column(names: Iterable[str], versions: Mapping[str, int]) -> str:
    """Versions as the value of a column, such as "contacts=2; moduli=1"."""
    return "; ".join(f"{name}={versions.get(name, FIRST)}" for name in sorted(names))


def changes(then: Mapping[str, int], now: Mapping[str, int]) -> list[str]:
    """What differs between the versions of a file and those of today, as text."""
    names = sorted(then.keys() | now.keys())
    pairs = [(name, then.get(name, FIRST), now.get(name, FIRST)) for name in names]
    return [f"{name} {before}, now {after}" for name, before, after in pairs if before != after]
