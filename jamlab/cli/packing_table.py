"""The table of packings that commands print: which measurements, under which headings, and what they mean."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jamlab.cli.console import print_json, print_note, print_table, progress_bar

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing

# name in files -> heading and format of a table; files and --json hold all of jamlab.measure.COLUMNS
SHOWN = {
    "rho": ("rho", ".6g"),
    "phi": ("phi", ".6g"),
    "z": ("z", ".4f"),
    "rattlers": ("rattlers", ".0f"),
    "pressure": ("pressure", ".5g"),
    "g": ("G", ".5g"),
    "g_x": ("G_xy", ".5g"),
    "b": ("B", ".5g"),
    "shape": ("shape", ".5g"),
    "void_sides": ("void_sides", ".4f"),
    "max_force": ("max_force", ".1e"),
}
G_NOTE = "G: relaxed shear modulus, mean over directions; G_xy: for shear along x of the box"
_MARKS = {True: "yes", False: "NO", None: "-"}
_MODULI = ("g", "g_x", "b")


def print_packings(packings: "list[Packing]", out: Path | None, as_json: bool) -> None:
    """Measure packings, write them to `out` if it is given, and print what was measured."""
    from jamlab.measure import measure_all, why_no_modulus
    from jamlab.packing.hdf5 import LABELS, NEGATIVE_G, write

    with progress_bar("measured") as progress:
        measured = measure_all(packings, progress=progress)
    if out is not None:
        write(out, packings, measured)
    marks = [_mark(p) for p in packings]
    if as_json:
        columns: dict[str, Any] = {name: values.tolist() for name, values in measured.items()}
        facts = {"out": out and str(out), "onset": packings[-1].onset, "converged": marks, "labels": LABELS}
        print_json({**facts, **columns})
        return
    filled = [name for name in SHOWN if any(value == value for value in measured[name])]
    lines = [[_cell(name, measured[name][k]) for name in filled] for k in range(len(packings))]
    for line, mark in zip(lines, marks, strict=True):
        line.append(_MARKS[mark])
    headings = [SHOWN[name][0] for name in filled]
    print_table(f"{packings[0].model}, n = {packings[0].n}", [*headings, "converged"], lines)
    if "g" in filled:
        print_note(G_NOTE)
    if None in marks:
        print_note(
            "converged -: the file does not say whether these states are minima, where alone G and B hold; "
            "max_force is what is left"
        )
    if any(measured["g"] < 0) or any(measured["g_x"] < 0):
        print_note(f"G {NEGATIVE_G}")
    reasons = [why_no_modulus(p) for p, g in zip(packings, measured["g"], strict=True) if g != g]
    print_not_stable(reasons)
    if out is not None:
        print_note(f"wrote {out}")


def _mark(packing: "Packing") -> bool | None:
    """Whether a state is what was asked for; None where no minimisation is known, as in a dump without that word."""
    if packing.max_force is None and not packing.converged:
        return None
    return packing.converged and packing.on_target


def _cell(name: str, value: float) -> str:
    if value != value:
        return "not stable" if name in _MODULI else "-"
    return f"{value:{SHOWN[name][1]}}"


def print_not_stable(reasons: Sequence[str]) -> None:
    """Explain the states that have no modulus, each reason once."""
    for reason in dict.fromkeys(reasons):
        print_note(f"not stable: {reason}")
