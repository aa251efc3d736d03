"""Kinds of packings: packings of one kind differ in their random start alone, and may be averaged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jamlab.errors import InputError
from jamlab.mechanics.stiffness import pressure
from jamlab.packing.magnitudes import ROUNDING
from jamlab.packing.packing import Packing
from jamlab.statistics.rows_of_one_kind import Campaign, Select, check_packings_once, choice_among, packings_of

_SAME_PRESSURE = 1e-3  # relative: `pack` meets a pressure to 1e-6
_FEW_SIZES = 4  # that are compared one by one between packings of several n
NAMED = 4  # kinds that a message names


def packings_of_one_kind(
    packings: Packing | Sequence[Packing] | Campaign, select: Select | None, *, frames: bool = False
) -> list[Packing]:
    """Packings of which a mean is taken, as a list.

    Args:
        packings: one or several, each once; or a campaign, whose converged states are taken.
        select: of a campaign: column of its table "states" -> value.
        frames: whether several packings may be frames of one flow, in boxes of one area, whose pressures differ.

    Raises:
        InputError: none, one that is given twice, or packings of several kinds.
    """
    if isinstance(packings, Campaign):
        each, rows = packings_of(packings, select)
    elif select is not None:
        raise InputError("select: applies to a campaign; choose among packings by hand")
    else:
        each = [packings] if isinstance(packings, Packing) else [*packings]
    if not each:
        raise InputError("packings: give one or more")
    alone = len(each) == 1 or (frames and _are_frames(each))  # then forces need not be known
    if not alone and len(kinds := group_by_kind(each)) > 1:
        remedy = choice_among(rows) if isinstance(packings, Campaign) else "Give those of one"
        raise InputError(f"packings of {len(kinds)} kinds have no common mean: {_few(list(kinds))}. {remedy}")
    if isinstance(packings, Campaign):
        check_packings_once(rows, "states")
    check_distinct(dict(enumerate(each)))
    return each


def _are_frames(packings: Sequence[Packing]) -> bool:
    """Whether packings are of the same particles in boxes of one area."""
    areas = np.array([packing.area for packing in packings])
    alike = bool(np.ptp(areas) <= ROUNDING * areas[0])
    return alike and not any(packings[0].difference(packing) for packing in packings[1:])


def _few(names: list[str]) -> str:
    return "; ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")


def check_distinct(packings: Mapping[int, Packing], what: str = "packings") -> None:
    """Refuse a packing that is given twice, which would count twice in a mean. `packings`: of one kind, by number."""
    seen: dict[Packing, int] = {}
    for k, packing in packings.items():
        if packing in seen:
            raise InputError(f"{what}[{seen[packing]}] and {what}[{k}] are of the same packing: leave one out")
        seen[packing] = k


def group_by_kind(packings: Sequence[Packing]) -> dict[str, list[int]]:
    """Numbers of the packings of each kind, in the order of its first one. Its name says particles, pressure, and what
    differs between kinds."""
    facts, pressures = [_facts(packing) for packing in packings], [pressure(packing) for packing in packings]
    groups: list[list[int]] = []
    for k, own in enumerate(facts):
        for group in groups:
            first = group[0]
            close = abs(pressures[k] - pressures[first]) <= _SAME_PRESSURE * abs(pressures[first])
            if close and own == facts[first]:
                group.append(k)
                break
        else:
            groups.append([k])
    firsts = [facts[group[0]] for group in groups]
    differing = [
        name
        for name in dict.fromkeys(name for own in firsts for name in own if name != "model")
        if any(own.get(name) != firsts[0].get(name) for own in firsts)
    ]
    names = []
    for own, (k, *_) in zip(firsts, groups, strict=True):
        force = f"p = {pressures[k]:.4g} {packings[k].unit_names.stress}"
        names.append(", ".join([own["model"][1], force, *(own[name][1] for name in differing if name in own)]))
    return {name: group for name, group in zip(_distinct(names), groups, strict=True)}


def group_by_number(packings: Sequence[Packing]) -> dict[int, list[int]]:
    """Numbers of the packings of each number n of particles; refuses packings that differ in more than n and their
    random start. Sizes are the same if they are few and the same, or many."""
    facts = []
    for packing in packings:
        own = {name: value[0] for name, value in _facts(packing).items() if name not in ("n", "fixed")}
        sizes = [size for size, _ in own["sizes"]]
        facts.append(own | {"sizes": sizes if len(sizes) <= _FEW_SIZES else "many", "walls": packing.walls})
    pressures = [pressure(packing) for packing in packings]
    groups: dict[int, list[int]] = {}
    for k, packing in enumerate(packings):
        groups.setdefault(packing.n, []).append(k)
        differing = [name for name in facts[0] | facts[k] if facts[0].get(name) != facts[k].get(name)]
        if not abs(pressures[k] - pressures[0]) <= _SAME_PRESSURE * abs(pressures[0]):
            differing.append("pressure")
        if differing:
            name = differing[0]
            values = pressures if name == "pressure" else [each.get(name) for each in facts]
            raise InputError(
                f"packings[0] and packings[{k}] differ in {name}, {values[0]} and {values[k]}: give packings that "
                "differ in n and their random start alone"
            )
    return groups


def _distinct(names: list[str]) -> list[str]:
    """Number the kinds that a label does not tell apart, such as sizes beyond the first few."""
    return [f"{name} ({names[: k + 1].count(name)})" if names.count(name) > 1 else name for k, name in enumerate(names)]


def _facts(packing: Packing) -> dict[str, tuple[Any, str]]:
    """A property that all packings of a mean share, besides their pressure: value and label."""
    kind, declared = packing.kind, packing.parameters
    sizes, counts = np.unique(kind.type_sizes(packing), return_counts=True)
    every = [(f"{size:.12g}", int(count)) for size, count in zip(sizes, counts, strict=True)]
    most = 4  # sizes that are named
    shown = " ".join(f"{count} × {size:.4g}" for size, count in zip(sizes[:most], counts, strict=False))
    vertices = np.unique(np.bincount(packing.particle)).tolist()
    held = int(packing.frame.fixed.sum())
    facts: dict[str, tuple[Any, str]] = {
        "model": (packing.model, kind.particles),
        "units": (packing.units, f"units {packing.units}"),
        "n": (packing.n, f"n = {packing.n}"),
        "ensemble": (packing.ensemble, packing.ensemble),
        "sizes": (every, f"{kind.size_name}s {shown}" + " ..." * (len(sizes) > most)),
        "vertices": (vertices, f"vertices {', '.join(map(str, vertices))}"),
        "fixed": ((held, packing.walls), f"{held} fixed" + ", walls" * packing.walls),
    }
    own = {name: value for name, value in packing.params.items() if not declared[name].each}
    return facts | {name: (value, f"{name} = {value}") for name, value in own.items()}
