"""Short runs of all that jamlab does, from which one sees what a constant of the code changes.

Each takes the folder of the states and returns what it found; `numbers` turns that into plain numbers.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

STATES = Path(__file__).parents[1] / "states"
BATTERY: dict[str, Callable[[Path], Any]] = {}


def scenario(function: Callable[[Path], Any]) -> Callable[[Path], Any]:
    BATTERY[function.__name__] = function
    return function


def numbers(found: Any) -> dict[str, Any]:
    """Name -> list of numbers or a text, of whatever a scenario returns; packings by their measures and their bits."""
    rows: dict[str, Any] = {}
    _collect(found, "", rows)
    return rows


def _collect(found: Any, name: str, rows: dict[str, Any]) -> None:
    import pandas as pd

    from jamlab.packing.packing import Packing

    if isinstance(found, Packing):
        _collect_packing(found, name, rows)
    elif isinstance(found, pd.DataFrame):
        kept = found.drop(columns=[each for each in found if "second" in str(each)])
        _collect({str(each): kept[each].to_numpy() for each in kept}, name, rows)
    elif isinstance(found, dict):
        for key, each in found.items():
            _collect(each, f"{name}/{key}", rows)
    elif dataclasses.is_dataclass(found) and not isinstance(found, type):
        kept = {each.name for each in dataclasses.fields(found)} - {"seconds", "frames", "packing", "provenance"}
        _collect({each: getattr(found, each, None) for each in sorted(kept)}, name, rows)
    elif found is None or isinstance(found, str | bytes | Path):
        rows[name] = str(found)
    elif hasattr(found, "tocoo"):
        _collect(found.toarray(), name, rows)
    else:
        try:
            array = np.asarray(found)
        except ValueError:
            array = np.empty(0, object)
        if array.dtype.kind in "biuf":
            rows[name] = array.astype(float).ravel().tolist()
        elif array.dtype.kind == "c":
            rows[name] = array.ravel().view(float).tolist()
        elif isinstance(found, list | tuple | np.ndarray):
            for place, each in enumerate(found):
                _collect(each, f"{name}/{place}", rows)
        else:
            rows[name] = type(found).__name__


def _collect_packing(p: Any, name: str, rows: dict[str, Any]) -> None:
    import jamlab

    rows[f"{name}/bits"] = crc32(p.positions.tobytes() + p.box.tobytes())
    rows[f"{name}/converged"] = bool(p.converged)
    rows[f"{name}/state"] = [p.phi, jamlab.packing_fraction(p), jamlab.contacts(p).z]
    rows[f"{name}/onset"] = [] if p.onset is None else [float(p.onset)]
    with contextlib.suppress(jamlab.JamlabError):
        measured = jamlab.measure(p, ("energy", "pressure"))
        rows[f"{name}/energy and pressure"] = [float(each) for each in measured.values()]


def prepare(folder: Path) -> None:
    """States that the runs start from; made once by the code as it is."""
    import jamlab

    folder.mkdir(parents=True, exist_ok=True)
    made = {
        "sp16": lambda: jamlab.pack(16, 1e-2, seed=1),
        "sp64": lambda: jamlab.pack(64, 1e-3, seed=2),
        "sp256": lambda: jamlab.pack(256, 1e-3, seed=3),
        "sp500": lambda: jamlab.pack(500, 3e-3, seed=3),
        "marginal": lambda: jamlab.pack(32, 1e-6, seed=4),
        "stabilized": lambda: jamlab.pack(32, 1e-2, seed=5, ensemble="shear-stabilized"),
        "sticky": lambda: jamlab.pack(32, 1e-2, seed=3, stickiness=0.05),
        "onset": lambda: jamlab.jam(n=16, seed=1),
        "walled": lambda: jamlab.relax(jamlab.with_walls(jamlab.pack(32, 1e-2, seed=1), thickness=1.5)),
        "flat": lambda: jamlab.relax(jamlab.with_walls(jamlab.pack(32, 1e-2, seed=1), thickness=1.5, flat=True)),
        "dp8": lambda: jamlab.jam(n=8, model="dp", seed=1),
        "dp36": lambda: _last(jamlab.compress(jamlab.jam(n=36, model="dp", seed=2), to=0.90, step=0.02)),
    }
    for name, make in made.items():
        path = folder / f"{name}.h5"
        if not path.exists():
            jamlab.write(path, make())


def _last(states: Any) -> Any:
    *_, last = states
    return last


def _read(folder: Path, name: str) -> Any:
    import jamlab

    return jamlab.read(folder / f"{name}.h5")


def _droplets() -> Any:
    import jamlab

    return jamlab.read(STATES / "compressed_droplets.h5")


def _shaken(p: Any, size: float, seed: int = 1) -> Any:
    return p.with_state(positions=p.positions + size * np.random.default_rng(seed).normal(size=p.positions.shape))


def _relaxed(p: Any) -> Any:
    import jamlab

    try:
        return jamlab.relax(p)
    except jamlab.JamlabError as error:
        return type(error).__name__


# ---- protocols -------------------------------------------------------------------------------------------------------


@scenario
def jam_disks(folder):
    import jamlab

    return [jamlab.jam(n=16, seed=seed) for seed in (1, 2)]


@scenario
def jam_disks_sheared(folder):
    import jamlab

    return jamlab.jam(n=16, seed=2, ensemble="shear-stabilized")


@scenario
def jam_many_disks(folder):
    import jamlab

    return jamlab.jam(n=220, seed=1)


@scenario
def jam_droplets(folder):
    import jamlab

    return [jamlab.jam(n=8, model="dp", seed=seed) for seed in (1, 2)]


@scenario
def jam_droplets_direct(folder):
    import jamlab

    return jamlab.jam(n=6, model="dp", seed=1, start="direct")


@scenario
def jam_droplets_sheared(folder):
    import jamlab

    return jamlab.jam(n=8, model="dp", seed=3, ensemble="shear-stabilized")


@scenario
def jam_droplets_of_few_vertices(folder):
    import jamlab

    return jamlab.evaluate(jamlab.jam(n=8, model="dp", seed=1, nv_small=12, delta=0.3))


@scenario
def pack_disks(folder):
    import jamlab

    return [jamlab.pack(32, pressure, seed=seed) for seed, pressure in ((1, 1e-3), (2, 1e-2), (3, 0.1), (4, 1e-5))]


@scenario
def pack_at_phi(folder):
    import jamlab

    return jamlab.pack(32, phi=0.9, seed=1)


@scenario
def pack_sheared(folder):
    import jamlab

    return jamlab.pack(16, 1e-3, seed=1, ensemble="shear-stabilized")


@scenario
def pack_sticky(folder):
    import jamlab

    return [jamlab.pack(32, 1e-3, seed=1, stickiness=0.02), jamlab.pack(16, 1e-2, seed=2, stickiness=0.1)]


@scenario
def pack_hertz(folder):
    import jamlab

    return jamlab.pack(32, 1e-4, seed=1, exponent=2.5)


@scenario
def pack_sizes(folder):
    import jamlab

    sizes = ("lognormal:0.2", "uniform:0.3", "power-law:3,2")
    found = []
    for each in sizes:
        try:
            found.append(jamlab.pack(24, 1e-2, seed=1, sizes=each))
        except jamlab.InputError as error:
            found.append(str(error)[:60])
    return found


@scenario
def compress_disks(folder):
    import jamlab

    onset = _read(folder, "onset")
    return [
        *jamlab.compress(onset, to=onset.phi + 0.02, step=0.005),
        *jamlab.compress(onset, to=onset.phi + 0.05, by="phi", per_decade=2, first_step=1e-4),
    ]


@scenario
def compress_droplets(folder):
    import jamlab

    starts = [_read(folder, "dp8"), *(jamlab.jam(n=8, model="dp", seed=seed) for seed in (2, 3, 4))]
    return [p for start in starts for p in jamlab.compress(start, to=0.88, step=0.01)]


@scenario
def compress_droplets_far(folder):
    import jamlab

    return [*jamlab.compress(_droplets(), to=0.96, step=0.03)]


@scenario
def decompress_disks(folder):
    import jamlab

    return [jamlab.decompress(_read(folder, "sp64"), 1e-5), jamlab.decompress(_read(folder, "sp16"), 1e-4)]


@scenario
def relax_disks(folder):
    import jamlab

    return [jamlab.relax(_shaken(_read(folder, name), 0.02)) for name in ("sp16", "sp64", "sticky", "flat", "walled")]


@scenario
def relax_many_disks(folder):
    import jamlab

    return jamlab.relax(_shaken(_read(folder, "sp500"), 0.02))


@scenario
def relax_marginal(folder):
    import jamlab

    return jamlab.relax(_shaken(_read(folder, "marginal"), 0.01), 1e-13)


@scenario
def relax_droplets(folder):

    starts = [_shaken(_droplets(), 0.01 * seed, seed) for seed in range(1, 7)]
    return [_relaxed(p) for p in [*starts, _shaken(_read(folder, "dp36"), 0.01)]]


@scenario
def relax_saddle(folder):
    import jamlab

    return jamlab.relax(jamlab.read(STATES / "droplets_on_a_saddle.h5"))


@scenario
def droplets_from_disks(folder):
    import jamlab

    return jamlab.droplets_from_disks(jamlab.pack(8, phi=0.88, seed=1))


@scenario
def minimize_box(folder):
    import jamlab

    p = _shaken(_read(folder, "stabilized"), 0.01)
    return jamlab.relax(p)


# ---- statics ---------------------------------------------------------------------------------------------------------


@scenario
def elasticity(folder):
    import jamlab

    found = []
    for name in ("sp16", "sp64", "sticky", "stabilized"):
        p = _read(folder, name)
        found += [jamlab.elastic_tensor(p), jamlab.nonaffine_response(p), jamlab.maxwell_count(p)]
    return [*found, jamlab.elastic_tensor(_droplets()), jamlab.elastic_tensor(_read(folder, "sp500"))]


@scenario
def moduli(folder):
    import jamlab

    p, q = _read(folder, "sp64"), _droplets()
    ways = ("linear-response", "finite-strain", "affine")
    return [
        *(jamlab.shear_modulus(p, method=way) for way in ways),
        *(jamlab.bulk_modulus(p, method=way) for way in ways),
        jamlab.shear_modulus(p, angle=np.linspace(0, 3, 4)),
        jamlab.shear_modulus(q, average=True),
    ]


@scenario
def vibrations(folder):
    import jamlab

    found = [jamlab.lowest_modes(_read(folder, name), 6).frequencies for name in ("sp16", "sp64", "sp500")]
    return [*found, jamlab.count_zero_modes(_read(folder, "marginal")), jamlab.lowest_modes(_droplets(), 4).frequencies]


@scenario
def rigidity(folder):
    import jamlab

    clusters = [jamlab.rigid_clusters(_read(folder, name)) for name in ("sp16", "sp64", "marginal", "sticky")]
    return [
        *clusters,
        jamlab.maxwell_count(_read(folder, "marginal")),
        jamlab.count_zero_modes(_read(folder, "sp500")),
        jamlab.contacts(_read(folder, "sp64")).forces,
    ]


@scenario
def evaluate(folder):
    import jamlab

    return [jamlab.evaluate(_read(folder, name)) for name in ("sp64", "sticky", "walled", "flat")] + [
        jamlab.evaluate(_droplets())
    ]


@scenario
def geometry(folder):
    import jamlab

    p, q = _read(folder, "sp64"), _droplets()
    of_droplets = (jamlab.contact_lengths, jamlab.shape_factors, jamlab.particle_areas, jamlab.relative_areas)
    return [
        *(jamlab.packing_fraction(each) for each in (p, q, _read(folder, "walled"), _read(folder, "flat"))),
        *(each(q) for each in of_droplets),
        *(jamlab.tessellation(each).area for each in (p, q)),
        *(jamlab.local_packing_fraction(each) for each in (p, q)),
        *(jamlab.hexatic_order(each) for each in (p, q)),
        jamlab.remove_rattlers(p),
        jamlab.shape_factors(q, rim=True),
    ]


@scenario
def voids(folder):
    import jamlab

    found = [jamlab.voids(each) for each in (_read(folder, "sp64"), _read(folder, "sticky"), _droplets())]
    return [*found, jamlab.void_statistics(*found[:2]), jamlab.void_statistics(found[2])]


@scenario
def slabs(folder):
    import jamlab

    return [jamlab.slab(_read(folder, name)) for name in ("walled", "flat")]


@scenario
def walls(folder):
    import jamlab

    p = _read(folder, "sp64")
    return [jamlab.relax(jamlab.with_walls(p, thickness=1.5, flat=flat)) for flat in (False, True)]


@scenario
def measure(folder):
    import jamlab

    return [
        jamlab.measure([_read(folder, "sp16"), _read(folder, "sp64")]),
        jamlab.measure([_droplets()]),
        jamlab.measure([_read(folder, "sp16"), _read(folder, "sp64")], ["z", "g"], processes=2),
    ]


# ---- rheology --------------------------------------------------------------------------------------------------------

OMEGA = np.logspace(-4, 1, 6)


@scenario
def spectra(folder):
    import jamlab

    p, q = _read(folder, "sp64"), _droplets()
    ways = ("auto", "dense", "direct", "reduced")
    return [
        *(jamlab.complex_modulus(p, OMEGA, method=way) for way in ways),
        *(jamlab.complex_modulus(q, OMEGA, method=way) for way in ways),
        jamlab.complex_modulus(p, OMEGA, jamlab.StokesDrag(1.0)),
        jamlab.complex_modulus(p, OMEGA, prestress=False),
        jamlab.complex_modulus(p, OMEGA, jamlab.ContactDamping(beta=0.0)),
    ]


@scenario
def spectra_of_many(folder):
    import jamlab

    p = _read(folder, "sp500")
    return [jamlab.complex_modulus(p, OMEGA, method=way) for way in ("auto", "direct", "reduced")]


@scenario
def spectra_marginal(folder):
    import jamlab

    omega = np.logspace(-9, 3, 7)
    return [jamlab.complex_modulus(_read(folder, name), omega, prestress=False) for name in ("marginal", "walled")] + [
        jamlab.complex_modulus(_read(folder, "sticky"), omega)
    ]


@scenario
def spectra_of_sticky_contacts(folder):
    import jamlab

    found = []
    for beta in (1e-6, 1e3, 1e6):
        for way in ("dense", "direct", "reduced"):
            try:
                law = jamlab.ContactDamping(beta=beta)
                found.append(jamlab.complex_modulus(_read(folder, "sp16"), OMEGA, law, method=way))
            except jamlab.JamlabError as error:
                found.append(type(error).__name__)
    return found


@scenario
def nonlinear(folder):
    import jamlab

    p = _read(folder, "sp16")
    return [
        jamlab.nonlinear_modulus(p, [0.01, 1.0], alpha=0.5, stress=1e-4),
        jamlab.nonlinear_modulus(p, [1.0], alpha=0.7, strain=1e-3),
        jamlab.effective_relaxation_time([0.1, 1.0], 1e-3, 0.5),
    ]


@scenario
def response(folder):
    import jamlab

    p = _read(folder, "sp64")
    return [
        jamlab.displacement_correlation(p, 1e-2),
        jamlab.displacement_response(p, 1e-2)[1],
        jamlab.mode_character(_read(folder, "dp8")),
        jamlab.mode_character(_droplets()),
        *jamlab.dynamical_matrices(_read(folder, "sp16")),
    ]


@scenario
def collapse(folder):
    import jamlab

    pressures = (0.03, 0.01, 0.003)
    spectra = [
        [jamlab.complex_modulus(jamlab.pack(16, q, seed=s), np.logspace(-4, 0, 5), prestress=False) for s in (1,)]
        for q in pressures
    ]
    return jamlab.scaling_collapse(pressures, spectra, resamples=20)


# ---- flow ------------------------------------------------------------------------------------------------------------


def _of_run(run: Any) -> Any:
    names = ("time", "strain", "stress", "pressure", "dissipated", "iterations")
    return {name: getattr(run, name, None) for name in names} | {"last": run.packing.positions}


@scenario
def shear(folder):
    import jamlab

    p = _read(folder, "sp16")
    runs = [
        jamlab.shear(p, rate=1e-2, strain=0.1, n_rows=20, snapshot_every=0.05),
        jamlab.shear(p, rate=1e-3, strain=0.02, n_rows=5, tolerance=1e-3),
        jamlab.shear(_read(folder, "sp64"), rate=1e-2, strain=0.02, n_rows=5, trajectory_error=True),
    ]
    return [*(_of_run(run) for run in runs), runs[0].velocity_profile, runs[0].summary]


@scenario
def shear_contact_damping(folder):
    import jamlab

    p = _read(folder, "sp16")
    laws = (jamlab.ContactDamping(beta=0.1), jamlab.ContactDamping(alpha=0.5), jamlab.StokesDrag(1.0))
    return [_of_run(jamlab.shear(p, 1e-2, 0.03, law, n_rows=5)) for law in laws]


@scenario
def shear_droplets(folder):
    import jamlab

    return _of_run(jamlab.shear(_read(folder, "dp8"), rate=1e-2, strain=0.01, n_rows=3))


@scenario
def shear_walls(folder):
    import jamlab

    return [_of_run(jamlab.shear(_read(folder, name), rate=1e-2, strain=0.02, n_rows=4)) for name in ("walled", "flat")]


@scenario
def curve(folder):
    import jamlab

    p = _read(folder, "sp16")
    found = jamlab.flow_curve(p, [0.03, 0.1, 0.3], strain=1.0, discard=0.5)
    return [found, jamlab.flow_cost(p, [0.01, 0.1], strain=0.5).select_dtypes("number").shape]


@scenario
def creep(folder):
    import jamlab

    p, law = _read(folder, "sp16"), jamlab.ContactDamping()
    runs = [
        jamlab.creep(p, 1e-4, 30.0, law),
        jamlab.creep(p, 3e-2, 10.0, law, largest_strain=1.0),
        jamlab.relax_stress(p, 1e-3, 10.0, law),
        jamlab.stop_flow(jamlab.shear(p, rate=0.1, strain=0.05, n_rows=3), 20.0),
    ]
    return [each for run in runs for each in (_of_run(run), getattr(run, "state", None), str(run))]


@scenario
def oscillation(folder):
    import jamlab

    p, law = _read(folder, "sp16"), jamlab.ContactDamping()
    return [jamlab.oscillate(p, *how, law, cycles=3, points=16) for how in ((1.0, 1e-4), (0.1, 0.02))]


@scenario
def quasistatic(folder):
    import jamlab

    p = _read(folder, "sp16")
    return [
        jamlab.quasistatic_shear(p, 0.1, step=0.005),
        jamlab.quasistatic_shear(_read(folder, "sp64"), 0.03, step=0.005, pressure=1e-3),
        jamlab.quasistatic_shear(_read(folder, "stabilized"), 0.02, step=0.01, pressure=1e-2),
        jamlab.quasistatic_shear(_read(folder, "walled"), 0.02, step=0.01),
    ]


@scenario
def quasistatic_droplets(folder):
    import jamlab

    return jamlab.quasistatic_shear(_droplets(), 0.02, step=0.01)


@scenario
def movie(folder):
    import jamlab

    run = jamlab.shear(_read(folder, "sp16"), rate=0.1, strain=0.04, n_rows=3, snapshot_every=0.02)
    with tempfile.TemporaryDirectory() as kept:
        frames = jamlab.write_movie(run, Path(kept) / "a.gif")
        return [frames, str(run)]


# ---- pictures --------------------------------------------------------------------------------------------------------


def _of_picture(found: Any) -> Any:
    values = {name: (each.value, each.quality) for name, each in found.numbers.items()}
    seen = [found.count, found.rho, found.z, found.shape, len(found.voids.area)]
    return [*seen, found.quality, list(found.reasons), values]


def _picture(packing: Any, pixels: int, **how: Any) -> Any:
    import jamlab

    try:
        return _of_picture(jamlab.micrograph(jamlab.synthetic_micrograph(packing, pixels, **how)))
    except jamlab.InputError as error:
        return f"refused: {error}"


@scenario
def picture(folder):
    return [_picture(_read(folder, "dp36"), 240), _picture(_read(folder, "dp36"), 200, noise=0.05, blur=1.0, light=0.5)]


@scenario
def picture_poor(folder):
    p = _read(folder, "dp36")
    return [_picture(p, 180, noise=0.2, blur=3.0, light=0.35), _picture(p, 180, noise=0.1, blur=2.0, film=4.0)]


@scenario
def picture_few(folder):
    few, many = _read(folder, "dp8"), _read(folder, "dp36")
    return [_picture(few, 120), _picture(_droplets(), 160), _picture(many, 100, blur=1.0)]


@scenario
def labels(folder):
    from label_masks import FAULTS
    from mask_trials import trial

    import jamlab

    found = []
    for name, pixels, every in (("dp36", 150, 1), ("sp64", 200, 4)):
        drawn = trial(_read(folder, name), pixels).labels
        for fault, spoil in list(FAULTS.items())[::every]:
            try:
                found.append([fault, _of_picture(jamlab.micrograph(labels=spoil(drawn, np.random.default_rng(1))))])
            except jamlab.InputError as error:
                found.append([fault, str(error)])
    return found


@scenario
def picture_files(folder):
    from PIL import Image

    import jamlab

    found, grey = [], jamlab.synthetic_micrograph(_read(folder, "dp36"), 160)
    with tempfile.TemporaryDirectory() as kept:
        for ending in ("png", "jpg", "tif"):
            path = Path(kept) / f"a.{ending}"
            Image.fromarray((255 * np.clip(grey, 0, 1)).astype(np.uint8)).save(path)
            found.append(_of_picture(jamlab.micrograph(path, pixel=0.5)))
        one = jamlab.micrograph(Path(kept) / "a.png")
        _figures(kept, one.plot)
        found.append(one.packing("dp") if hasattr(one, "packing") else 0)
    return found


@scenario
def tracks(folder):
    import jamlab

    p = _read(folder, "dp36")
    moved = [jamlab.synthetic_micrograph(p.with_state(positions=p.positions + s), 150) for s in (0.0, 0.1)]
    return jamlab.track_droplets(moved, memory=1)


# ---- files, commands, campaigns --------------------------------------------------------------------------------------


@scenario
def files(folder):
    import jamlab

    found = []
    with tempfile.TemporaryDirectory() as kept:
        for p in (_read(folder, "sp16"), _droplets(), _read(folder, "sticky"), _read(folder, "flat")):
            for ending in ("h5", "data", "dump", "xyz"):
                path = Path(kept) / f"a.{ending}"
                try:
                    jamlab.write(path, p)
                    found.append(jamlab.read(path))
                except jamlab.JamlabError as error:
                    found.append(type(error).__name__)
        rng, p = np.random.default_rng(5), _read(folder, "sp16")
        rows = "\n".join(f"{x:.6g},{y:.6g},{d / 2:.5g}" for (x, y), d in zip(p.positions, p.diameters, strict=True))
        (Path(kept) / "t.csv").write_text("x,y,radius\n" + rows + "\n")
        found.append(jamlab.read(Path(kept) / "t.csv", box=p.box, units="k"))
        rows = "\n".join(f"{x:.3g},{y:.3g}" for x, y in rng.uniform(0, 5, (120, 2)))
        (Path(kept) / "u.csv").write_text("x,y\n" + rows + "\n")
        try:
            found.append(jamlab.read(Path(kept) / "u.csv", box=[5, 5], units="k", radii=0.2))
        except jamlab.JamlabError as error:
            found.append(str(error))
        jamlab.write_contacts(Path(kept) / "c", p)
    return found


@scenario
def universes(folder):
    import warnings

    import jamlab

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = [jamlab.from_universe(jamlab.universe(p))[0] for p in (_read(folder, "sp16"), _droplets())]
        with tempfile.TemporaryDirectory() as kept:
            jamlab.write(Path(kept) / "a.dump", [_read(folder, "sp16")] * 3)
            found += jamlab.from_universe(jamlab.universe(Path(kept) / "a.dump"))
    return found


@scenario
def page(folder):
    import jamlab

    with tempfile.TemporaryDirectory() as kept:
        onset = _read(folder, "onset")
        jamlab.write_page(Path(kept) / "a.html", [*jamlab.compress(onset, to=onset.phi + 0.01, step=0.005)])
        jamlab.write_page(Path(kept) / "b.html", _droplets())
        return [(Path(kept) / name).stat().st_size for name in ("a.html", "b.html")]


def _figures(folder: Any, *plots: Any) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    for plot in plots:
        with contextlib.suppress(AttributeError):
            plot()
        pyplot.savefig(Path(folder) / "a.png")
        pyplot.close("all")


@scenario
def figures(folder):
    import jamlab

    p, q = _read(folder, "sp64"), _droplets()
    things = [p, q, jamlab.voids(p), jamlab.voids(q), jamlab.tessellation(p), jamlab.complex_modulus(p, OMEGA)]
    things += [jamlab.contacts(p), jamlab.slab(_read(folder, "flat")), jamlab.hexatic_order(p)]
    things += [jamlab.rigid_clusters(p), _read(folder, "walled")]
    with tempfile.TemporaryDirectory() as kept:
        _figures(kept, *(each.plot for each in things if hasattr(each, "plot")))
    return [repr(each)[:300] for each in things]


@scenario
def commands(folder):
    from commands import call

    found = []
    with tempfile.TemporaryDirectory() as kept:
        state = str(folder / "sp16.h5")
        for words in (
            ("pack", "--n", "16", "--pressure", "0.02", "--json"),
            ("jam", "-n", "8", "-o", "j.h5"),
            ("compress", "j.h5", "--to", "0.9", "--step", "0.02", "--out", "s.h5"),
            ("analyze", state),
            ("analyze", "s.h5", "--csv", "s.csv"),
            ("gstar", state, "--points", "3"),
            ("shear", state, "--rate", "0.1", "--strain", "0.02"),
            ("convert", state, "p.data"),
            ("deck", "in.sp.shear", "--data", "p.data", "--out", "x"),
            ("--help",),
            ("jma",),
        ):
            done = call(kept, *words)
            found.append([done.exit_code, len(done.stdout.splitlines())])
    return found


@scenario
def campaign(folder):
    from campaigns import run_here, written

    import jamlab

    with tempfile.TemporaryDirectory() as kept:
        path = written(
            Path(kept) / "c.toml",
            n=8,
            seeds=3,
            compress=None,
            pressures=[1e-2],
            observables=["spectra", "voids", "correlation"],
            omega=[0.1, 1.0],
            correlation_omega=[0.1],
        )
        c = jamlab.open_campaign(path)
        plan = str(c.plan()) if hasattr(c, "plan") else ""
        run_here(c)
        return [c.table(name) for name in ("states", "spectra", "voids")] + [len(plan)]


@scenario
def campaign_of_workers(folder):
    from campaigns import written

    import jamlab

    with tempfile.TemporaryDirectory() as kept:
        c = jamlab.open_campaign(written(Path(kept) / "c.toml", n=8, seeds=2, compress={"to": 0.86, "step": 0.01}))
        c.run(workers=1)
        return [c.table("states"), c.mean("states") if hasattr(c, "mean") else 0]


# ---- statistics, estimates, hints ------------------------------------------------------------------------------------


@scenario
def statistics(folder):
    from jamlab.statistics import confidence
    from jamlab.statistics.data_collapse import fit_scaling_exponents
    from jamlab.statistics.herschel_bulkley import herschel_bulkley
    from jamlab.statistics.power_laws import fit_power_law

    rng, x = np.random.default_rng(3), np.geomspace(1e-4, 0.3, 25)
    noisy = 2.0 * x**0.5 * np.exp(0.1 * rng.normal(size=25))
    walk = np.convolve(rng.normal(size=600), np.ones(20) / 20, "valid")
    n, grid = np.array([32.0, 64.0, 128.0]), np.geomspace(1e-5, 0.1, 40)
    curves = [[(grid, grid * m**1.2 / (1 + (grid * m**1.2) ** 0.5) / m**0.3) for m in n]]
    rates = np.geomspace(1e-3, 1, 7)
    return [
        fit_power_law(x, noisy),
        fit_power_law(x, noisy, (0.5, 1.0)),
        fit_power_law(x, np.exp(-x)),
        confidence.block_average(walk),
        confidence.block_average(walk[:60]),
        confidence.block_average(np.cumsum(rng.normal(size=200))),
        confidence.block_average(rng.normal(size=40)),
        confidence.bootstrap([rng.normal(size=12)], lambda arrays: arrays[0].mean()),
        fit_scaling_exponents(n, curves, start=(1.5, 0.7)),
        herschel_bulkley(rates, 0.01 + 0.1 * rates**0.5, np.full(7, 1e-4)),
        herschel_bulkley(rates, 0.01 + 0.1 * rates**0.5 * (1 + 0.1 * rng.normal(size=7)), np.full(7, 3e-3)),
    ]


@scenario
def estimates(folder):
    import jamlab

    p = _read(folder, "sp500")
    return [
        str(jamlab.choose(0.9, {"z": 0.2, "g": 0.1})),
        str(jamlab.choose(0.86, {"a": 0.02})),
        *(str(jamlab.estimate_cost(name, 0.9, error)) for name, error in (("z", 0.05), ("g", 0.01), ("b", 0.02))),
        str(jamlab.estimate_cost("rho-J", None, 1e-3)),
        str(jamlab.choose_flow(p, rate=3e-2)),
        str(jamlab.choose_flow(p, omega=0.1, amplitude=1e-3)),
    ]


@scenario
def estimate(folder):
    import jamlab

    found = jamlab.estimate("z", 0.86, 0.2)
    return [found.value, found.error, found.made if hasattr(found, "made") else 0]


@scenario
def scene(folder):
    import jamlab

    return jamlab.scene(0.9, n=8, tolerance={"z": 1.0})


@scenario
def hints(folder):
    import jamlab

    said = []
    asked = [(jamlab, name) for name in ("pak", "g_prime", "psi6", "viscosity")]
    for thing, name in [*asked, (_read(folder, "sp16"), "psi6")]:
        try:
            getattr(thing, name)
        except AttributeError as error:
            said.append(str(error))
    for arguments in ({"pressur": 1e-2}, {"mu": 0.1}, {"N": 16}):
        try:
            jamlab.pack(16, **arguments)
        except (jamlab.JamlabError, TypeError) as error:
            said.append(str(error))
    return said


@scenario
def refusals(folder):
    """Arguments beyond their limits."""
    import jamlab

    p, said = _read(folder, "sp16"), []
    calls = (
        lambda: jamlab.pack(10**7, 1e-2),
        lambda: jamlab.pack(16, 5.0),
        lambda: jamlab.jam(16, tolerance=1e-3),
        lambda: jamlab.jam(16, tolerance=1e-30),
        lambda: jamlab.shear(p, rate=1e9, strain=1.0),
        lambda: jamlab.shear(p, rate=1e-20, strain=1.0),
        lambda: jamlab.shear(p, rate=0.1, strain=1e9),
        lambda: jamlab.shear(p, rate=0.1, strain=1.0, tolerance=10.0),
        lambda: jamlab.oscillate(p, 1e-30, 1e-3),
        lambda: jamlab.oscillate(p, 1.0, 100.0),
        lambda: jamlab.creep(p, 1e9, 1.0),
        lambda: jamlab.quasistatic_shear(p, 1e6),
        lambda: jamlab.complex_modulus(p, [1e-300]),
        lambda: jamlab.pack(16, 1e-2, size_ratio=1e4),
        lambda: jamlab.ContactDamping(beta=1e30),
        lambda: jamlab.ContactDamping(alpha=0.1),
        lambda: jamlab.jam(16, "dp", gamma=1e40),
    )
    for each in calls:
        try:
            each()
            said.append("done")
        except (jamlab.JamlabError, TypeError, ValueError) as error:
            said.append(str(error))
    return said


@scenario
def jam_disks_in_steps(folder):
    import jamlab

    return jamlab.jam(n=6, seed=2, search="incremental")


def quiet() -> Any:
    """Context in which nothing is printed."""
    stack = contextlib.ExitStack()
    stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
    stack.enter_context(contextlib.redirect_stderr(io.StringIO()))
    return stack
