"""Motion between a view of a packing and a later state, which no view may change otherwise than by its units."""

import numpy as np

import jamlab
from jamlab.packing.natural_units import mean_size


def grown(packing):
    """Particles larger by 1 %, which no force holds in balance."""
    if packing.model == "sp":
        return packing.with_state(diameters=1.01 * packing.diameters)
    return packing.with_state(params=packing.params | {"a0": 1.02 * packing.params["a0"]})


def later(view, amount):
    """A state after a strain of the box and displacements of particles: disks along the forces on grown ones, droplets
    along the third moment of their outlines."""
    p = view.packing
    if p.model == "sp":
        push = jamlab.evaluate(grown(p)).forces
    else:
        spokes = p.positions - p.centroids[p.particle]
        push = np.array(
            [(each * (each**2).sum(axis=1)[:, None]).mean(axis=0) for each in np.split(spokes, p.offsets[1:-1])]
        )
    push = mean_size(p) * amount * push / np.hypot(*push.T).max()
    gradient = np.array([[1 + 0.1 * amount, 0.3 * amount * view.sign], [0.0, 1 - 0.2 * amount]])
    return p.with_state(box=p.box @ gradient.T, positions=p.positions @ gradient.T + push[p.particle])


def strained(view):
    """Local strains, whose off-diagonal parts change their sign in a mirror."""
    from invariant_cases import ALL, AREA, EACH, LENGTH, NUMBER

    found = jamlab.local_strain(view.packing, later(view, 0.1))
    e = found.strain
    parts = {"xx": e[:, 0, 0], "yy": e[:, 1, 1], "xy": view.sign * e[:, 0, 1], "yx": view.sign * e[:, 1, 0]}
    named = {name: (part, (NUMBER, EACH)) for name, part in (parts | {"neighbors": found.neighbors}).items()}
    lengths = {
        "moved": (np.hypot(*found.displacements.T), (LENGTH, EACH)),
        "d2min": (found.d2min, (AREA, EACH)),
    }
    return named | lengths | {"participation": (found.participation, (NUMBER, ALL))}


def _series(view):
    return [view.packing, *(later(view, amount) for amount in (0.05, 0.1))]


def walked(view):
    """Mean square displacements."""
    from invariant_cases import AREA

    found = jamlab.mean_square_displacement(_series(view))
    return {name: (getattr(found, name), AREA) for name in ("along", "across")}


def kept(view):
    """Overlaps; no particle moves by just that length."""
    from invariant_cases import NUMBER

    found = jamlab.self_overlap(_series(view), 0.037 * mean_size(view.packing))
    return {"overlap": (found.overlap, NUMBER)}
