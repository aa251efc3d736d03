"""Take both models from a random start through jamming to rho = 0.95; measure, store and draw the packings.

The two models run side by side in separate processes; pictures and page are made from the packings they return.
"""

import platform
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from jamlab.checks import check_bidisperse, check_number
from jamlab.cli.interruption import KeptStates
from jamlab.errors import ConvergenceError, InputError
from jamlab.figures.explorer.states import unit_labels
from jamlab.figures.explorer.write_page import explorer_assets, explorer_fragment
from jamlab.figures.html_page import Section, TextTable, save_picture, write_report
from jamlab.figures.packing_pictures import curve_figure, modulus_figure, packings_figure
from jamlab.measure import measure_all, why_no_modulus
from jamlab.packing.hdf5 import write
from jamlab.packing.packing import Packing
from jamlab.plotting.palette import MODEL_STYLE
from jamlab.processes.progress import Progress
from jamlab.processes.side_by_side import run_side_by_side
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.rheology.mean_spectrum import Spectra, mean_spectra
from jamlab.storage.atomic_file import check_targets, make_folder
from jamlab.storage.verified_file import versions

_ONSET = {"sp": 0.9, "dp": 0.5}  # share of a run to rho = 0.95 until onset; measured with 64 particles
STEP = 0.01  # in rho, between stored states
ENSEMBLE = "shear-stabilized"  # a box without residual shear stress: G > 0 in every direction
OMEGA = np.logspace(-6, 2, 41)  # 1/tau_1: from the slow to the fast limit of G*, five per decade
HEADINGS = ["ρ", "φ", "z", "rattlers", "pressure", "G", "A", "max force"]
G_NOTE = (
    "G: relaxed shear modulus, mean over directions, in a box sheared until no shear stress is left "
    f"({ENSEMBLE}); units ε/σ² (SP), ε/l² (DP)"
)
_FILES = ("index.html", "sp.h5", "dp.h5", "packings.png", "z.png", "g.png", "gstar.png")
FORMATS = {"rho": ".4f", "phi": ".4f", "z": ".3f", "rattlers": ".0f", "pressure": ".2e", "g": ".4f", "shape": ".4f"}


@dataclass(frozen=True)
class ModelSweep:
    """One model from onset to the densest state."""

    model: str  # "sp" or "dp"
    packings: list[Packing]  # onset first
    measured: dict[str, NDArray[np.float64]]  # column -> (len(packings),), see `jamlab.measure`
    seconds: float  # wall time of the whole sweep


def run_demo(
    n: int, seed: int, to: float, out: Path, progress: Mapping[str, Progress], *, force: bool = True
) -> tuple[dict[str, ModelSweep], Spectra | None]:
    """Run both models; write `sp.h5`, `dp.h5`, pictures and `index.html` into a folder. Returns sweeps by model, and
    G*(omega) of the densest SP packing, None if that packing is unstable."""
    check_bidisperse(n, seed, 1.0)
    check_number("to", to, 1.0)
    missing = not out.exists()
    make_folder(out)
    try:
        check_targets(out, _FILES, replace=force)
        run, models = partial(_run_model, n=n, seed=seed, to=to, out=out), ("sp", "dp")
        found = run_side_by_side(run, models, len(models), report=lambda model, *step: progress[model](*step))
    finally:
        if missing and out.is_dir() and not any(out.iterdir()):
            out.rmdir()
    sweeps = dict(zip(models, found, strict=True))
    try:
        spectrum: Spectra | None = mean_spectra([sweeps["sp"].packings[-1]], OMEGA)[0]
    except ConvergenceError:
        spectrum = None
    for sweep in sweeps.values():
        write(out / f"{sweep.model}.h5", sweep.packings, sweep.measured)
    _draw(sweeps, spectrum, out, {"n": str(n), "seed": str(seed)})
    return sweeps, spectrum


def table_rows(sweep: ModelSweep) -> list[list[str]]:
    """Format a sweep as a table, one row per state; a state that did not converge is marked."""
    lines = []
    for k, packing in enumerate(sweep.packings):
        row = {name: values[k] for name, values in sweep.measured.items()}
        cells = ["-" if np.isnan(row[name]) else f"{row[name]:{form}}" for name, form in FORMATS.items()]
        if np.isnan(row["g"]):
            cells[list(FORMATS).index("g")] = "not stable"
        mark = "" if packing.converged else " (not converged)"
        lines.append([*cells, f"{packing.max_force:.0e}{mark}"])
    return lines


def unstable(sweep: ModelSweep) -> list[str]:
    """Say of each state without a modulus why it has none."""
    reasons = []
    for packing, rho, g in zip(sweep.packings, sweep.measured["rho"], sweep.measured["g"], strict=True):
        if np.isnan(g):
            reasons.append(f"ρ = {rho:.4f}: {why_no_modulus(packing)}")
    return reasons


def _run_model(model: str, report: Progress, *, n: int, seed: int, to: float, out: Path) -> ModelSweep:
    """Make and measure a sweep; its states so far are kept in the file that it ends in."""
    began = time.perf_counter()
    first = _ONSET[model]
    onset = jam(model, n, seed, ensemble=ENSEMBLE, progress=lambda share, text: report(first * share, text))
    if to <= onset.phi:
        raise InputError(f"to = {to}: {model} with n = {n}, seed = {seed} jams at {onset.phi:.4f}, so go higher")
    kept = KeptStates(out / f"{model}.h5", interval=0.0)
    kept.add(onset)
    for packing in compress(onset, to, STEP, progress=lambda share, text: report(first + (1 - first) * share, text)):
        kept.add(packing)
    return ModelSweep(model, kept.states, measure_all(kept.states), time.perf_counter() - began)


_LEAD = (
    "From a random start at φ = 0.20 through jamming onset (first row of each table) to dense packings. The box is "
    "sheared until no shear stress is left, so that no stable state has a negative shear modulus. Lengths, energies "
    "and stresses are in the units of Boromand et al.; G is the mean over directions, A the mean shape factor (SP: "
    "disks cut by their power cells; DP: polygons without rim, 1.012 and 1.024 when round)."
)
_PACKINGS = (
    "Packings in their periodic cell: large particles blue, small ones pink, rattlers grey; black lines join particles "
    "in contact. DP: the fill is the outline with the rim of the circulo-lines, the line inside it the bare polygon."
)


def _draw(sweeps: dict[str, ModelSweep], spectrum: Spectra | None, out: Path, facts: dict[str, str]) -> None:
    pictures = _draw_pictures(sweeps, spectrum)
    if spectrum is None:
        facts = facts | {"G*(ω)": "left out: the densest SP packing is not stable"}
    sections = [
        Section(f"Sweep of {MODEL_STYLE[m]['label']}", fragment=explorer_fragment(s.packings, observables=s.measured))
        for m, s in sweeps.items()
    ]
    for heading, (name, figure, caption) in pictures.items():
        sections.append(Section(heading, save_picture(figure, out / name), caption))
    tables = []
    for sweep in sweeps.values():
        units = unit_labels(sweep.packings[0])
        of = {"pressure": units["stress"], "G": units["stress"], "max force": units["force"]}
        columns = [f"{name} [{of[name]}]" if name in of else name for name in HEADINGS]
        tables.append(TextTable(columns, table_rows(sweep), MODEL_STYLE[sweep.model]["label"]))
    sections.append(Section("Numbers", tables=tables))
    times = {f"wall time {model.upper()}": f"{sweep.seconds:.1f} s" for model, sweep in sweeps.items()}
    law = ", ".join(f"{k} = {v}" for k, v in sweeps["dp"].packings[-1].params.items() if k != "a0")
    facts = facts | {"DP parameters": law} | times | versions() | {"Python": platform.python_version()}
    heading = "Jamming of disks and deformable polygons"
    write_report(out / "index.html", heading, _LEAD, sections, facts, explorer_assets())


def _draw_pictures(sweeps: dict[str, ModelSweep], spectrum: Spectra | None) -> dict[str, tuple[str, Figure, str]]:
    densest = {model: sweep.packings[-1] for model, sweep in sweeps.items()}
    titles = {}
    for model, sweep in sweeps.items():
        rho, z = (sweep.measured[name][-1] for name in ("rho", "z"))
        titles[model] = f"{MODEL_STYLE[model]['label']}, ρ = {rho:.3f}, z = {z:.2f}"
    tables = {model: sweep.measured for model, sweep in sweeps.items()}
    unit = r"$\epsilon/\sigma^2$ (SP), $\epsilon/l^2$ (DP)"
    left_out = [f"Not stable: {MODEL_STYLE[m]['label']}, {line}." for m, s in sweeps.items() for line in unstable(s)]
    moduli = " ".join(["Relaxed shear modulus by linear response, mean over directions.", *left_out])
    z = curve_figure(tables, "z", "contact number $z$")
    g = curve_figure(tables, "g", f"shear modulus $G$, mean over directions\n[{unit}]")
    pictures = {
        "Densest packings": ("packings.png", packings_figure(densest, titles), _PACKINGS),
        "Contacts": ("z.png", z, "Contacts per particle, rattlers left out."),
        "Shear modulus": ("g.png", g, moduli),
    }
    if spectrum is not None:
        caption = (
            "Complex shear modulus G*_xy of the densest SP packing, for shear along x of the box, balanced contact "
            f"damping (β = 1), with pre-stress. Its static limit is G_xy = {spectrum.limit('g0'):.4f}; the mean over "
            f"directions, as in the table, is G = {spectrum.mean_g:.4f}."
        )
        name = f"SP, ρ = {tables['sp']['rho'][-1]:.3f}"
        figure = modulus_figure({name: spectrum}, r"$\epsilon/\sigma^2$")
        pictures["Complex shear modulus"] = ("gstar.png", figure, caption)
    return pictures


def unconverged(sweeps: dict[str, ModelSweep]) -> list[str]:
    """Name the states whose minimisation did not reach the tolerance."""
    return [
        f"{sweep.model} rho = {rho:.4f}: max force {packing.max_force:.1e}"
        for sweep in sweeps.values()
        for packing, rho in zip(sweep.packings, sweep.measured["rho"], strict=True)
        if not packing.converged
    ]
