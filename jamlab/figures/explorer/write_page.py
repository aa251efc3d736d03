"""Write a sweep as one HTML file that needs no network: the picture, a slider, and z, G and pressure beside it.

One page holds states of the same particles, in the same units, and not too much of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, select_autoescape
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from jamlab.arrays import Array, ArrayLike, Indices
from jamlab.checks import checked
from jamlab.errors import InputError, named
from jamlab.figures.explorer.states import along, curves, observe, pack_state, stored_columns, strains, unit_labels
from jamlab.packing.hdf5 import check_one_sweep
from jamlab.packing.packing import Packing
from jamlab.packing.packing_plot import bar_colours, has_many_sizes, size_colours
from jamlab.plotting.palette import BLUE, GREEN, LARGE, ORANGE, OTHER, RATTLER, SIDE_COLOURS, SMALL
from jamlab.processes.progress import Progress, told
from jamlab.storage.atomic_file import atomic_file, check_target
from jamlab.storage.formats import check_ending
from jamlab.storage.verified_file import FilePath, version_of


@dataclass(frozen=True)
class PageLimits:
    """Pages that a browser still shows."""

    states: int = 20_000  # more do not come out as single particles on a screen, and slow the page down
    bytes: int = 50_000_000  # a page that a browser still opens within seconds


PAGE_LIMITS = PageLimits()


def check_bytes(total: float, states: int, every: int) -> None:
    """Refuse a page that grows too large, by the bytes of all states."""
    if total > PAGE_LIMITS.bytes:
        fewer = int(-(-total * every // PAGE_LIMITS.bytes))
        remedy = f"take every {fewer}th, every={fewer} or --every {fewer}" if states > 1 else "draw it as a figure"
        raise InputError(
            f"{states} states are {total / 1e6:.0f} MB, and a page holds {PAGE_LIMITS.bytes / 1e6:.0f} MB: {remedy}"
        )


_FOLDER = files("jamlab.figures.explorer")
_PAGES = Environment(loader=PackageLoader("jamlab.figures.explorer", ""), autoescape=select_autoescape())


@checked
def write_page(
    path: FilePath,
    packings: Packing | Iterable[Packing],
    *,
    every: int = 1,
    observables: Mapping[str, ArrayLike] | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a packing or a sweep as one self-contained interactive HTML page.

    A slider selects the state. Force network, rattlers, voids, cells and displacements can be switched on.
    Pointing at a contact shows its force and gap; pointing at a particle, its shape factor, z and area. 80 states of 64
    droplets take 5 MB and 15 s.

    Args:
        path: HTML file to create or replace, .html.
        packings: one packing, or states of the same particles in their order, e.g. of `jamlab.compress`.
        every: show every k-th state.
        observables: known values by name, (states,): rho, z, z_all, rattlers, pressure, g. Others are measured.
        progress: called after each state with (fraction done, text); True: print it.

    Raises:
        InputError: no packing; packings that differ in model, units, number or sizes of particles; more than 20 000
            particles or 50 MB; outlines of polygons that cross.
        StorageError: the file cannot be written.

    Example:
        >>> onset = jamlab.jam(n=16, seed=1)
        >>> jamlab.write_page("page.html", jamlab.compress(onset, to=0.9, step=0.02))
        >>> from pathlib import Path
        >>> Path("page.html").read_text()[:15]
        '<!doctype html>'
    """
    check_ending(path, "page")
    check_target(path)
    states = [packings] if isinstance(packings, Packing) else list(packings)
    fragment = explorer_fragment(states, every=every, observables=observables, progress=progress)
    first, count = states[0], len(states[::every])
    walls = int(first.flat_walls.sum())
    title = f"{first.n - walls} {first.kind.particles}{' between flat walls' if walls else ''}"
    title += f", {count} states" if count > 1 else ""
    ensembles = {
        "fixed-box": "Periodic cell of fixed shape.",
        "shear-stabilized": "Periodic cell, relaxed to zero shear stress.",
    }
    lead = f"{ensembles[first.ensemble]} {unit_labels(first)['meaning']}. Particles are numbered from 0 as in jamlab."
    write_sections(path, title, lead, [("", fragment)], _facts(first, states[-1]))


def write_sections(
    path: FilePath, title: str, lead: str, sections: Sequence[tuple[str, Markup]], facts: Mapping[str, str]
) -> None:
    """Write a page of sections, each with its heading, such as several explorers; facts stand at the end."""
    assets = explorer_assets()
    page = _PAGES.get_template("page.html").render(
        title=title, lead=lead, assets=assets, sections=sections, facts=facts
    )
    with atomic_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def explorer_fragment(
    packings: Iterable[Packing],
    *,
    every: int = 1,
    observables: Mapping[str, ArrayLike] | None = None,
    progress: Progress | None = None,
) -> Markup:
    """One explorer as a piece of HTML; a page may hold several, and `explorer_assets` once. Arguments and errors as in
    `write_page`."""
    if every < 1:
        raise InputError(f"{named('every', every)}: must be 1 or more; 2 shows every second state")
    everything = list(packings)
    check_one_sweep(everything)
    if (n := everything[0].n) > PAGE_LIMITS.states:
        raise InputError(
            f"{n} particles: a page shows {PAGE_LIMITS.states} at most; draw states instead, packing.plot()"
        )
    known = stored_columns(observables or {}, len(everything))
    chosen = everything[::every]
    strain, rows, packed, size = strains(everything)[::every], [], [], 0
    for k, packing in enumerate(chosen):
        try:
            packed.append(htmlsafe_json_dumps(pack_state(packing, chosen[k - 1] if k else None)))
        except InputError as error:
            raise type(error)(f"state {k * every}: {error}") from error
        numbers = {name: float(values[k * every]) for name, values in known.items()}
        rows.append(observe(packing, numbers, float(strain[k])))
        size += len(packed[-1])
        check_bytes(size * len(chosen) / (k + 1), len(chosen), every)
        if progress is not None:
            told(progress)((k + 1) / len(chosen), f"state {k + 1} of {len(chosen)}")
    toggles = (  # key, what it switches, whether it is on at first
        ("f", "forces", True),
        ("r", "rattlers", True),
        ("v", "voids", False),
        ("c", "cells", False),
        ("d", "displacements", False),
    )
    return Markup(
        _PAGES.get_template("fragment.html").render(
            head=htmlsafe_json_dumps(_head(chosen, rows)),
            states=packed,
            along=along(chosen),
            curves=curves(chosen[0]),
            toggles=toggles,
        )
    )


_COLOURS = {  # of palette.js, on paper and on a dark screen alike
    **{"large": LARGE, "small": SMALL, "rattler": RATTLER, "wall": GREEN, "wallBesideVoids": BLUE},
    **{"move": ORANGE, "pointed": ORANGE, "sides": SIDE_COLOURS, "otherSides": OTHER},
}


def explorer_assets() -> Markup:
    """Style and script of all explorers of a page, as HTML."""
    style = _FOLDER.joinpath("explorer.css").read_text(encoding="utf-8")
    script = f"const SHARED = {htmlsafe_json_dumps(_COLOURS)};\n"
    scripts = (  # in the order in which they need each other
        "palette.js",
        "packed_states.js",
        "view.js",
        "outlines.js",
        "scene.js",
        "pointing.js",
        "legend.js",
        "curves.js",
        "controls.js",
        "explorer.js",
    )
    script += "\n".join(_FOLDER.joinpath(name).read_text(encoding="utf-8") for name in scripts)
    return Markup(f"<style>\n{style}</style>\n<script>\n(() => {{\n'use strict';\n{script}}})();\n</script>")


def _listed(values: Array | Indices | None, factor: float = 1) -> list[float] | None:
    return None if values is None else (factor * values).tolist()


def _head(packings: list[Packing], rows: list[dict[str, Any]]) -> dict[str, Any]:
    first = packings[0]
    sizes, boxes = first.kind.sizes(first), np.array([packing.box for packing in packings])
    return {
        "model": first.model,
        "particle": first.kind.particles.removesuffix("s"),
        "n": first.n,
        "units": unit_labels(first),
        "offsets": _listed(first.offsets),
        "radii": _listed(first.diameters, 0.5),
        "extent": [float((boxes[:, 0, 0] + np.abs(boxes[:, 1, 0])).max()), float(boxes[:, 1, 1].max())],
        "large": (sizes > sizes.mean()).tolist(),
        "sizes": _size_colours(first) if has_many_sizes(first) else None,
        "along": asdict(along(packings)),
        "curves": [asdict(quantity) for quantity in curves(first)],
        "rows": rows,
    }


def _size_colours(packing: Packing) -> dict[str, Any]:
    """Colours of more sizes than two: of every particle, and of a bar from the smallest to the largest."""
    sizes = packing.kind.sizes(packing)
    return {
        "name": packing.kind.size_label,
        "values": sizes.tolist(),
        "colours": size_colours(packing).tolist(),
        "bar": bar_colours(),
        "ends": [float(sizes.min()), float(sizes.max())],
    }


def _facts(first: Packing, last: Packing) -> dict[str, str]:
    law = {name: value for name, value in last.params.items() if name != "a0"}
    facts = {"force law": ", ".join(f"{name} = {value}" for name, value in law.items())}
    if last.phi_J is not None:
        facts["onset"] = f"φ = {last.phi_J:.6g}"
    made_by = last.provenance or first.provenance
    facts |= {name: str(made_by[name]) for name in ("protocol", "seed", "source") if name in made_by}
    return facts | {"drawn by": f"jamlab {version_of('jamlab')}"}
