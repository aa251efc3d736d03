"""Plots of results and of flows: pictures beside stored ones, and the numbers behind lines, widths and labels."""

import subprocess
import sys
from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from bare_pictures import bare, both, covers_points, picture, state
from matplotlib import pyplot
from matplotlib.figure import Figure

import jamlab
from jamlab.flow.flow_run import SERIES
from jamlab.flow.oscillate import fit_harmonics
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.statistics.herschel_bulkley import herschel_bulkley

OMEGA = np.geomspace(1e-4, 1e2, 25)
LIGHT = """
import sys
from dataclasses import fields, replace
import jamlab
p = jamlab.Packing("sp", [[2.0, 0.0], [0.0, 2.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
network, voids = jamlab.contacts(p), jamlab.voids(p)
assert "matplotlib" not in sys.modules
import matplotlib
matplotlib.use("svg")
from matplotlib.figure import Figure
import jamlab.plotting.curves
for thing in (p, network, voids):
    thing.plot(Figure().subplots())
assert "matplotlib.pyplot" not in sys.modules and matplotlib.get_backend() == "svg"
"""


def disks(positions, diameters, box):
    return jamlab.Packing("sp", np.asarray(box), np.atleast_2d(positions), {"k": 2.0}, "k", diameters)


def made_up_spectra(mu=0.5, lam=1.0):
    """Spectra of three pressures that collapse."""
    pressures, omega = (1e-2, 1e-3, 1e-4), np.geomspace(1e-5, 1, 26)
    found = []
    for p in pressures:
        g = p**mu * np.sqrt(1 + 1j * omega / p**lam)
        zero = np.zeros_like(omega)
        found.append(
            [jamlab.results.ComplexModulus(omega, g.real, g.imag, p**mu, 1.0, 0.0, "made up", zero, None, "k")]
        )
    return pressures, found


def collapse():
    return jamlab.scaling_collapse(*made_up_spectra(), resamples=0)


def modulus():
    return jamlab.complex_modulus(state("disks"), OMEGA, method="dense")


def sheared():
    """Two stress drops, and a state that missed its tolerance."""
    strain = np.linspace(0, 0.1, 11)
    stress = np.array([0, 2, 4, 5, 3, 4, 6, 7, 6, 7, 8]) * 1e-3
    none, good = np.zeros(11), np.arange(11) != 6
    rows = dict.fromkeys((f.name for f in fields(QuasistaticShear) if f.type == "Array"), none)
    rows |= {"strain": strain, "stress": stress, "converged": good, "event": np.isin(np.arange(11), (4, 8))}
    rest = {
        "frames": (state("disks"),),
        "damping": None,
        "background_drag": 0.0,
        "tolerance": None,
        "force_tolerance": 1e-12,
        "unit": "k",
    }
    counts = {"steps": 11, "iterations": 0, "seconds": 0.1, "shear_rate": 0.0, "strain_asked": 0.1}
    return QuasistaticShear(**rows, **rest, **counts)


CELLS = {  # made without LAMMPS, as what follows
    "contacts": lambda: jamlab.contacts(state("disks")),
    "packing": lambda: state("droplets"),
    "voids": lambda: jamlab.voids(state("disks")),
    "tessellation": lambda: jamlab.tessellation(state("disks")),
    "order": lambda: jamlab.hexatic_order(state("disks")),
}
CURVES = {
    "void statistics": lambda: jamlab.void_statistics(jamlab.voids(state("disks"))),
    "elastic tensor": lambda: jamlab.elastic_tensor(state("disks")),
    "slow shear": lambda: jamlab.nonaffine_response(state("disks")),
    "modulus": modulus,
    "nonlinear": lambda: jamlab.nonlinear_modulus(state("disks"), OMEGA, jamlab.ContactDamping(alpha=0.5), stress=1e-3),
    "elements": lambda: modulus().spectrum,
    "correlation": lambda: jamlab.displacement_correlation(state("disks"), 1e-2),
    "contact lengths": lambda: jamlab.contact_lengths(state("droplets")),
    "modes": lambda: jamlab.lowest_modes(state("disks"), 20),
    "collapse": collapse,
    "sheared": sheared,
}
RESULTS = CELLS | CURVES
UNITS = {  # of both axes, where there is one
    **{"elastic tensor": ("", "k"), "slow shear": ("d", ""), "elements": ("", "k"), "correlation": ("d", "")},
    **{"contact lengths": ("l", ""), "collapse": ("", "k"), "creep": ("", "1/k")},
    **dict.fromkeys(("modulus", "nonlinear", "modes", "sheared", "start-up", "flow curve", "relaxation"), ("", "k")),
    **dict.fromkeys(("Herschel-Bulkley", "oscillation"), ("", "k")),
}


PACKING = jamlab.Packing("sp", [[2.0, 0.0], [0.0, 2.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
HOW = {"frames": (PACKING,), "damping": jamlab.ContactDamping(), "background_drag": 0.0, "tolerance": 1e-2, "unit": "k"}
EFFORT = {"steps": 100, "iterations": 1000, "seconds": 1.0}


def flow_rows(**known):
    count = len(known["time"])
    return {name: np.zeros(count) for name in SERIES} | HOW | EFFORT | known


def start_up():
    strain = np.linspace(0, 2, 101)
    stress = 4e-3 * (1 - np.exp(-strain / 0.05)) * (1 + 0.5 * np.exp(-(((strain - 0.25) / 0.2) ** 2)))
    known = {"time": 100 * strain, "strain": strain, "stress": stress, "elastic_stress": 0.8 * stress - 5e-4}
    return jamlab.results.ShearRun(**flow_rows(**known, work=np.cumsum(stress)), shear_rate=1e-2, strain_asked=2.0)


def flow_curve():
    rates = np.geomspace(1e-4, 1e-1, 7)
    stress = 1e-3 + 0.1 * rates**0.5
    means = dict.fromkeys(
        [
            *("elastic_stress", "elastic_stress_stderr", "pressure", "pressure_stderr", "normal_stress_difference"),
            *("normal_stress_difference_stderr", "dissipation", "plastic_events", "seconds", "energy_error"),
            *("z_all", "z_all_stderr", "ambiguous_contacts"),
        ],
        np.ones(7),
    )
    drift = np.array([5.0, 0, 1, -1, 0.5, 0, 0])
    known = {"rate": rates, "stress": stress, "stress_stderr": 0.05 * stress, "drift": drift, **means}
    return jamlab.results.FlowCurve(**known, discard=1.0, strain=4.0, **HOW)


def oscillation(omega=0.1, amplitude=0.1, third=0.1):
    phase = 2 * np.pi * np.arange(65) / 32
    strain = amplitude * np.sin(phase)
    stress = amplitude * (0.05 * np.sin(phase) + 0.03 * np.cos(phase) + third * 0.05 * np.sin(3 * phase))
    known = {"time": phase / omega, "strain": strain, "rate": amplitude * omega * np.cos(phase), "stress": stress}
    found = np.array([fit_harmonics(known["time"][1:33], stress[1:33], omega, amplitude)] * 2)
    return jamlab.results.Oscillation(
        **flow_rows(**known),
        omega=omega,
        amplitude=amplitude,
        points_per_cycle=32,
        cycle_harmonics=found,
        finished=True,
    )


def creep():
    time = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 61)])
    return jamlab.results.CreepRun(
        **flow_rows(time=time, strain=1e-4 * time / (1 + 0.1 * time)),
        applied_stress=1e-4,
        residual_stress=0.0,
        duration=1e3,
    )


def relaxation():
    time = np.geomspace(5e-3, 1e3, 61)
    stress = 1e-5 * (0.1 + 0.3 / (1 + time))
    answer = {"applied_strain": 1e-5, "step_time": 1e-2, "residual_stress": 0.0, "duration": 1e3}
    return jamlab.results.StressRelaxation(**flow_rows(time=time, stress=stress), **answer)


FLOWS = {
    "start-up": start_up,
    "flow curve": flow_curve,
    "Herschel-Bulkley": lambda: herschel_bulkley(
        flow_curve().rate, flow_curve().stress, flow_curve().stress_stderr, "k"
    ),
    "oscillation": oscillation,
    "creep": creep,
    "relaxation": relaxation,
}


@cache
def result(name):
    return (RESULTS | FLOWS)[name]()


@pytest.fixture(autouse=True)
def no_figure_left():
    yield
    pyplot.close("all")


@picture
def test_force_networks():
    """Lines as wide as forces, in every image; the rattler grey."""
    return both(lambda axes, packing, title: jamlab.contacts(packing).plot(axes))


@picture
def test_particles_and_order():
    """Disks in a tilted cell, coloured by size; droplets by their order."""
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    jamlab.Packing("sp", [[4.0, 0.0], [2.6, 4.0]], [[0.2, 0.3], [3.6, 1.1]], {"k": 1.0}, "k", [1.0, 1.6]).plot(left)
    jamlab.hexatic_order(state("droplets")).plot(right)
    return bare(figure, columns=2)


@picture
def test_curves():
    """One panel for each, in the order of `CURVES`."""
    figure = Figure(figsize=(2.6 * len(CURVES), 2.4), layout="constrained")
    for axes, name in zip(figure.subplots(1, len(CURVES)), CURVES, strict=True):
        result(name).plot(axes)
    return bare(figure, columns=len(CURVES))


@pytest.mark.parametrize("name", [*RESULTS, *FLOWS])
def test_every_plot_has_labels_with_units_and_legends_that_cover_no_point(name):
    axes = result(name).plot()
    labels = axes.get_xlabel(), axes.get_ylabel()
    assert pyplot.get_fignums() and axes.figure is pyplot.gcf()  # shown by a notebook
    assert [label.partition("  [")[2].rstrip("]") for label in labels] == list(UNITS.get(name, ("", "")))
    assert all(labels) == (name not in CELLS)
    if name not in CELLS:  # whose legends and scales stand outside the axes
        axes.figure.set_layout_engine("none")
        assert not covers_points(axes.figure)


def test_importing_stays_light_and_no_backend_is_forced():
    done = subprocess.run([sys.executable, "-W", "error", "-c", LIGHT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def texts(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_moduli_are_on_the_lines_and_negative_ones_are_counted():
    s = modulus()
    axes = s.plot(Figure().subplots(), label="β = 1", color="black")
    for line, values in zip(axes.lines, (s.storage, s.loss), strict=True):
        np.testing.assert_array_equal(line.get_xydata(), np.column_stack([OMEGA, values]))
        assert line.get_color() == "black"
    assert texts(axes) == ["$G'_{xy}$  β = 1", "$G''_{xy}$  β = 1"] and axes.get_xscale() == "log"
    lower = jamlab.results.ComplexModulus(
        OMEGA, s.storage - s.storage[10], -s.loss, -1.0, 1.0, 1.0, "made up", s.error_bound
    )
    axes = lower.plot(Figure().subplots())
    assert texts(axes) == [
        "$G'_{xy}$, 11 value(s) not above 0 left out",
        "$G''_{xy}$, 25 value(s) not above 0 left out",
    ]
    assert np.isfinite(axes.lines[0].get_ydata()).sum() == 14 and "[" not in axes.get_ylabel()
    for direction, index in (("pure", "pure"), (np.pi / 4, r"45^\circ")):
        axes = replace(s, direction=direction).plot(Figure().subplots())
        assert index in texts(axes)[0] and index in axes.get_ylabel()


@picture
def test_curves_of_flow():
    """One panel for each, in the order of `FLOWS`."""
    figure = Figure(figsize=(2.6 * len(FLOWS), 2.4), layout="constrained")
    for axes, make in zip(figure.subplots(1, len(FLOWS)), FLOWS.values(), strict=True):
        make().plot(axes)
    return bare(figure, columns=len(FLOWS))


def test_flows_are_drawn_as_they_were_found():
    curve = flow_curve()
    axes = curve.plot(Figure().subplots())
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["not steady", "contact damping, β = 1"]
    loop = oscillation().plot(Figure().subplots(), against="rate").lines[0]
    assert loop.get_xdata() == pytest.approx(oscillation().rate[-33:])
    with pytest.raises(jamlab.InputError):
        oscillation().plot(against="time")
    assert oscillation().third_over_first == pytest.approx(0.1 * 0.05 / np.hypot(0.05, 0.03))
