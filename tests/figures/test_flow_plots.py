"""Plots of flows in time, of made-up rows: one stored picture, labels, legends, styles."""

import numpy as np
import pytest
from bare_pictures import artists, bare, picture
from matplotlib import pyplot
from matplotlib.figure import Figure
from matplotlib.legend import Legend

import jamlab
from jamlab.flow.oscillate import fit_harmonics
from jamlab.flow.recording import SERIES
from jamlab.statistics.herschel_bulkley import herschel_bulkley

PACKING = jamlab.Packing("sp", [[2.0, 0.0], [0.0, 2.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
HOW = {"frames": (PACKING,), "damping": jamlab.ContactDamping(), "background": 0.0, "tolerance": 1e-2, "unit": "k"}
EFFORT = {"steps": 100, "iterations": 1000, "seconds": 1.0}


def rows(**known):
    count = len(known["time"])
    return {name: np.zeros(count) for name in SERIES} | HOW | EFFORT | known


def start_up():
    strain = np.linspace(0, 2, 101)
    stress = 4e-3 * (1 - np.exp(-strain / 0.05)) * (1 + 0.5 * np.exp(-(((strain - 0.25) / 0.2) ** 2)))
    known = {"time": 100 * strain, "strain": strain, "stress": stress, "elastic_stress": 0.8 * stress - 5e-4}
    return jamlab.ShearRun(**rows(**known, work=np.cumsum(stress)), shear_rate=1e-2, strain_asked=2.0)


def flow_curve():
    rates = np.geomspace(1e-4, 1e-1, 7)
    stress = 1e-3 + 0.1 * rates**0.5
    means = dict.fromkeys(
        [
            *("elastic_stress", "elastic_stress_error", "pressure", "pressure_error", "normal_stress_difference"),
            *("normal_stress_difference_error", "dissipation", "plastic_events", "seconds", "imbalance"),
        ],
        np.ones(7),
    )
    drift = np.array([5.0, 0, 1, -1, 0.5, 0, 0])
    known = {"rates": rates, "stress": stress, "stress_error": 0.05 * stress, "drift": drift, **means}
    return jamlab.FlowCurve(**known, discard=1.0, strain=4.0, **HOW)


def oscillation(omega=0.1, amplitude=0.1, third=0.1):
    phase = 2 * np.pi * np.arange(65) / 32
    strain = amplitude * np.sin(phase)
    stress = amplitude * (0.05 * np.sin(phase) + 0.03 * np.cos(phase) + third * 0.05 * np.sin(3 * phase))
    known = {"time": phase / omega, "strain": strain, "rate": amplitude * omega * np.cos(phase), "stress": stress}
    found = np.array([fit_harmonics(known["time"][1:33], stress[1:33], omega, amplitude)] * 2)
    return jamlab.Oscillation(
        **rows(**known), omega=omega, amplitude=amplitude, points=32, cycle_harmonics=found, finished=True
    )


def creep():
    time = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 61)])
    return jamlab.CreepRun(
        **rows(time=time, strain=1e-4 * time / (1 + 0.1 * time)), applied=1e-4, residual=0.0, duration=1e3
    )


def relaxation():
    time = np.geomspace(5e-3, 1e3, 61)
    stress = 1e-5 * (0.1 + 0.3 / (1 + time))
    answer = {"step_strain": 1e-5, "step_time": 1e-2, "residual": 0.0, "duration": 1e3}
    return jamlab.StressRelaxation(**rows(time=time, stress=stress), **answer)


def diagram():
    third = {(0.1, 0.01): 0.001, (0.1, 0.1): 0.1, (1.0, 0.01): 0.0, (1.0, 0.1): 0.05}
    return jamlab.pipkin([oscillation(w, a, share) for (w, a), share in third.items()])


RESULTS = {
    "start-up": (start_up, (r"strain $\gamma$", r"shear stress $\sigma$  [k]")),
    "flow curve": (flow_curve, (r"rate of shear $\dot\gamma\,\tau_1$", r"shear stress $\sigma$  [k]")),
    "Herschel-Bulkley": (
        lambda: herschel_bulkley(flow_curve().rates, flow_curve().stress, flow_curve().stress_error, "k"),
        (r"rate of shear $\dot\gamma\,\tau_1$", r"shear stress $\sigma$  [k]"),
    ),
    "oscillation": (oscillation, (r"strain $\gamma$", r"shear stress $\sigma$, less its mean  [k]")),
    "Pipkin": (diagram, (r"angular frequency $\omega\,\tau_1$", r"amplitude $\gamma_0$")),
    "creep": (creep, (r"time $t/\tau_1$", "compliance $J(t)$  [1/k]")),
    "relaxation": (relaxation, (r"time $t/\tau_1$", "relaxation modulus $G(t)$  [k]")),
}


@pytest.fixture(autouse=True)
def no_figure_left():
    yield
    pyplot.close("all")


@picture
def test_curves_of_flow():
    """One panel for each, in the order of `RESULTS`."""
    figure = Figure(figsize=(2.6 * len(RESULTS), 2.4), layout="constrained")
    for axes, (make, _) in zip(figure.subplots(1, len(RESULTS)), RESULTS.values(), strict=True):
        make().plot(axes)
    return bare(figure, columns=len(RESULTS))


@pytest.mark.parametrize("name", RESULTS)
def test_labels_and_legends_that_cover_no_point(name):
    make, labels = RESULTS[name]
    axes = make().plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == labels
    axes.figure.set_layout_engine("none")
    axes.figure.draw_without_rendering()
    for line in axes.lines:
        places = line.get_transform().transform(line.get_xydata())
        assert not any(legend.get_window_extent().count_contains(places) for legend in artists(axes, Legend))


@pytest.mark.parametrize("name", ["flow curve", "Pipkin"])
def test_axes_and_style_that_matplotlib_does_not_know_are_refused(name):
    make = RESULTS[name][0]
    for wrong in (pyplot, "ax", Figure()):
        with pytest.raises(jamlab.InputError, match="give matplotlib Axes"):
            make().plot(wrong)
    with pytest.raises(jamlab.InputError, match="colour = 'red'"):
        make().plot(colour="red")
    assert make().plot(Figure().subplots(), alpha=0.5) is not None


def test_what_is_drawn_is_what_was_found():
    curve = flow_curve()
    axes = curve.plot(Figure().subplots())
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["not steady", "contact damping, β = 1"]
    loop = oscillation().plot(Figure().subplots(), against="rate").lines[0]
    assert loop.get_xdata() == pytest.approx(oscillation().rate[-33:])
    with pytest.raises(jamlab.InputError, match="unknown against 'time'"):
        oscillation().plot(against="time")
    assert oscillation().third_over_first == pytest.approx(0.1 * 0.05 / np.hypot(0.05, 0.03))
    assert "2 frequencies" in repr(diagram()) and "; all periodic" in repr(diagram())
