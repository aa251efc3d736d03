"""Random starts: disks placed at random, and loose droplets in their place, from which a search for onset starts."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from jamlab.arguments.choices import Units
from jamlab.arrays import Array
from jamlab.checks import check_choice, check_number, is_number
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.laws.laws import law_class
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.parameter import UNITS, check_params
from jamlab.models.disks import DISKS
from jamlab.models.droplets import DROPLETS, free_area, free_polygon_area, regular_polygon
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import Recipe
from jamlab.protocols.size_distributions import Sizes, disk_diameters
from jamlab.protocols.units_of_recipes import units_of


@dataclass(frozen=True)
class Apart:
    """Springs that leave random disks apart."""

    # largest force of springs that leave random disks apart, and steps of FIRE at most
    force: float = 1e-3
    steps: int = 2000


APART = Apart()


def push_apart(packing: Packing) -> Packing:
    """Random disks pushed apart by springs, where their law is not one of jamlab's own: it may be endlessly stiff where
    they lie upon each other."""
    if packing.law.deck_part:
        return packing
    springs = packing.with_state(params={packing.units: packing.params[packing.units]})
    with Session(natural_scales(springs).to_natural(springs)) as session:
        session.minimize(APART.force, minimizer="fire", steps=APART.steps)
        moved = natural_scales(springs).from_natural(session.packing())
    return packing.with_state(positions=moved.positions)


MOST_VERTICES = 10_000  # of a droplet; [B] has 12 and 17


_UNITS: tuple[Units, ...] = get_args(Units)


def random_disks(
    n: int,
    seed: int,
    *,
    phi: float,
    units: Units = "eps",
    ratio: float | None = None,
    large: float = 0.5,
    sizes: Sizes | None = None,
    **parameters: Any,
) -> Packing:
    """Place disks uniformly at random in a square box.

    Args:
        n: number of disks; even unless `large` or `sizes` says otherwise; the small ones come first.
        seed: of numpy's default generator; one seed gives one packing, bit for bit.
        phi: nominal packing fraction.
        units: "eps" or "k", or those that the law has instead; in both the mean of the two diameters is 1.
        ratio: diameter ratio of large to small disks; default: as in `sp.parameters`.
        large: number share of the large disks, rounded to whole disks.
        sizes: a distribution by name, or n diameters, see `jamlab.protocols.size_distributions`.
        parameters: `law`, its name, and parameters of the force law.
    """
    check_number("phi", phi, 2.0)
    check_choice("units", units, UNITS)
    units = usual_units(parameters, units)
    params = disk_params(units, **parameters)
    diameters = disk_diameters(n, seed, ratio=ratio, large=large, sizes=sizes)
    side = float(np.sqrt(np.pi / 4 * np.sum(diameters**2) / phi))
    positions = side * np.random.default_rng(seed).random((n, 2))
    return Packing(DISKS.name, np.diag([side, side]), positions, params, units, diameters)


def disks_of(recipe: Recipe, phi: float, sizes: Array, usual: Units) -> Packing:
    """Random disks of a recipe at a nominal packing fraction, see `push_apart`. `sizes`: (n,) diameters; `usual`: units
    unless the recipe or its law says others."""
    units = units_of(recipe, usual, law_class(recipe.parameters).strengths)
    return push_apart(random_disks(recipe.n, recipe.seed, phi=phi, units=units, sizes=sizes, **recipe.parameters))


def law_of_disks(recipe: Recipe, usual: Units) -> PairLaw:
    """Law of the disks of a recipe, of mean diameter 1; `usual`: as in `disks_of`."""
    units = units_of(recipe, usual, law_class(recipe.parameters).strengths)
    params = disk_params(units, **recipe.parameters)
    return law_class(params).of(params, units)


def disk_params(units: Units, **changes: Any) -> dict[str, Any]:
    """Give force-law parameters of disks.

    Args:
        units: "eps" or "k".
        changes: `law`, its name, and parameters of the law; its strength is that of `lammps_inputs/parts/sp`.
    """
    declared = DISKS.parameters(None, changes)
    own = [name for name in declared if name not in UNITS]
    unknown = sorted(changes.keys() - set(own))
    if unknown:
        known = f"use {', '.join(own)}; " if own else ""
        whose = f"law {changes['law']!r}" if "law" in changes else "model sp"
        raise InputError(f"{whose} has no parameter {unknown[0]!r}: {known}{units} and the mean diameter are always 1")
    params = {units: float(defaults(DISKS.name)[units]), **changes}
    check_params(DISKS.name, units, DISKS.parameters(units, changes), params)
    for name in changes:
        declared[name].check(name, changes[name], made=True)
    return params


def usual_units(parameters: Mapping[str, Any], usual: Units) -> Units:
    """Units of packings of disks with these parameters: the usual ones, or those that their law has instead."""
    strengths = law_class(parameters).strengths
    return usual if usual in strengths else next(units for units in _UNITS if units in strengths)


def droplet_params(
    n: int, large: float = 0.5, sizes: Array | None = None, /, *, vertices: Any = None, **changes: Any
) -> tuple[NDArray[np.int64], dict[str, Any]]:
    """Give vertices and force-law parameters of n droplets, of two sizes with small ones first, or of given ones.

    Args:
        n: number of droplets.
        large: number share of the large ones.
        sizes: instead, (n,) in any unit: droplets have the rest areas (size over mean size)^2.
        vertices: of all droplets, or (n,) of each; by default in proportion to the size, so that edges are alike, and
            (nv_small + nv_large)/2 for the mean size, but at least three.
        changes: values that replace defaults of `lammps_inputs/parts/dp`, and `law` and its parameters, see
            `jamlab.laws.laws`.

    Returns:
        (n,) vertices of each droplet, and `Packing.params` with the rest areas a0 in units of l^2.
    """
    values = {name: value for name, value in defaults(DROPLETS.name).items() if name != "longest_edge"}
    known = [*values, *(name for name in DROPLETS.parameters("eps", changes) if name not in (*values, "a0"))]
    if unknown := set(changes) - set(known):
        raise InputError(f"model dp has no parameter {sorted(unknown)[0]!r}: use {', '.join(known)}")
    values |= changes
    two = _whole_counts("nv_small and nv_large", [values.pop("nv_small"), values.pop("nv_large")])
    # a0_large/a0_small = (nv_large/nv_small)^2 and l = 1: edges at rest are alike on both sizes
    many = round(large * n)
    own = 2 * np.repeat(two, [n - many, many]) / two.sum() if sizes is None else sizes / sizes.mean()
    nv = np.maximum(3, np.rint(0.5 * two.sum() * own)).astype(np.int64)
    if vertices is not None:
        given = np.ravel(np.asarray(vertices, dtype=object)).tolist()
        if len(given) not in (1, n):
            raise InputError(f"vertices hold {len(given)} numbers for n = {n} droplets: give one for all, or one each")
        nv = np.broadcast_to(_whole_counts("vertices", given), n)
    params: dict[str, Any] = {**values, "a0": own**2}
    declared = DROPLETS.parameters("eps", params)
    check_params(DROPLETS.name, "eps", declared, params)
    for name, value in params.items():
        declared[name].check(name, value, made=True)
    free_polygon_area(nv, params)  # refuses a line tension that leaves no droplet
    return nv, params


def _whole_counts(name: str, counts: list[Any]) -> NDArray[np.int64]:
    for count in counts:
        if not is_number(count) or not 3 <= count <= MOST_VERTICES or count != int(count):
            raise InputError(
                f"a polygon cannot have {count!r} vertices: {name} are whole numbers from 3 to {MOST_VERTICES}"
            )
    return np.array(counts, dtype=np.int64)


def free_diameters(nv: NDArray[np.int64], params: dict[str, Any]) -> Array:
    """(n,) diameter of the disk that each free droplet with its rim just fits into."""
    area = free_polygon_area(nv, params)
    return np.asarray(2 * np.sqrt(2 * area / (nv * np.sin(2 * np.pi / nv))) + params["delta"])


def place_droplets(centres: Array, box: Array, nv: NDArray[np.int64], params: dict[str, Any], seed: int) -> Packing:
    """Place free droplets, regular polygons of random orientation, around given centres.

    Args:
        centres: (n, 2).
        box: (2, 2).
        nv: (n,) vertices.
        params: as in `Packing.params`.
        seed: seed of the orientations.
    """
    angles = np.random.default_rng([seed, 1]).random(len(nv))
    areas = free_polygon_area(nv, params)
    shapes = [
        centre + regular_polygon(int(count), area, 2 * np.pi * turn)
        for centre, count, area, turn in zip(centres, nv, areas, angles, strict=True)
    ]
    offsets = np.concatenate([[0], np.cumsum(nv)])
    return Packing(DROPLETS.name, box, np.concatenate(shapes), params, offsets=offsets)


def droplet_cell(nv: NDArray[np.int64], params: dict[str, Any], phi: float) -> float:
    """Side of the square box in which droplets have nominal packing fraction phi."""
    return float(np.sqrt(np.sum(free_area(nv, params)) / phi))
