"""Variables that the parts of decks take from a packing."""

from typing import Any

from jamlab.engine.deck_defaults import defaults
from jamlab.engine.lammps_words import text
from jamlab.errors import EngineError
from jamlab.packing.lammps_files import MOST_TYPES, section_of_sizes, types
from jamlab.packing.packing import Packing

EDGE_ROOM = 1.5  # of the longest edge: how far edges may grow before the neighbour cutoff misses contacts


def edge_limit(packing: Packing) -> float:
    """Length that no edge of a polygon may outgrow: it sets the neighbour cutoff, so it stays near what there is; 0
    without edges."""
    longest = packing.kind.longest_edge(packing)
    return max(float(defaults(packing.kind.name).get("longest_edge", 0.0)), EDGE_ROOM * longest) if longest else 0.0


def deck_variables(packing: Packing) -> dict[str, Any]:
    """Variables by name; `own_sizes` is among them where sizes go by disk instead of by type."""
    table, kind = types(packing), packing.kind
    section = section_of_sizes(packing, table)
    found = kind.lammps_variables(packing)
    found |= {"out": kind.name, "of_python": "yes", "skin": defaults(f"{kind.name}.minimum")["skin"]}
    found |= {f"d{k + 1}": d for k, d in enumerate(table.values)}
    if table.classes and not kind.sizes_by_atom:
        if not (kind.sizes_by_disk and packing.law.sizes_by_disk):
            raise EngineError(
                f"{packing.law}: more than {MOST_TYPES} sizes of {kind.particles}, but its pair style of LAMMPS "
                "takes a size from its type; use fewer sizes"
            )
        found["own_sizes"] = f"sizes {section} power {text(packing.law.power_of_contact)}"
        found["section"] = f"fix {section} NULL {section}"
    if limit := edge_limit(packing):
        found["longest_edge"] = limit
    return found
