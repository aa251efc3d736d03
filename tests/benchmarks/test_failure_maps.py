"""Each known failure provoked: jamlab says so instead of returning a number."""

import csv

import numpy as np
import pytest

import jamlab
from jamlab.benchmarks.failure_maps import disks, droplets, spectra
from jamlab.benchmarks.failure_maps.map_figure import stability_figure
from jamlab.benchmarks.failure_maps.page import MAPS, counts, stability
from jamlab.benchmarks.failure_maps.verdict import Map, Outcome, attempt, judge, try_relaxing
from jamlab.protocols.model_choice import Way
from jamlab.protocols.relaxation import relax
from jamlab.protocols.scene import bring_to


@pytest.fixture(scope="module")
def jolted():
    return disks.jolt_minimum(32, 0.95)


@pytest.fixture(scope="module")
def jammed():
    onset = jamlab.jam("sp", 8, 1)
    *_, last = jamlab.compress(onset, 0.9, 0.02)
    return last


def test_verdicts_of_minimisations():
    assert judge(1e-13, 1e-12, 1.0, 1.1, 1.0) == "converged"
    assert judge(1e-11, 1e-12, 1.0, 1.1, 1.0) == "stalled"
    assert judge(1e-13, 1e-12, 0.9, 1.1, 1.0) == "wrong basin"
    assert judge(np.nan, 1e-12, 1.0, 1.1, 1.0) == "blew up" == judge(1.0, 1e-12, 50.0, 1.1, 1.0)


@pytest.mark.slow
def test_fire_with_the_default_step_and_with_one_too_long(jolted):
    start, minimum = jolted
    assert disks.try_fire(start, minimum, 0.1, 0.1)[0] == "converged"
    assert disks.try_fire(start, minimum, 4.0, 0.1)[0] == "blew up"
    assert disks.try_fire(start, minimum, 1e-3, 0.1)[0] == "stalled"


def test_overdamped_step_beyond_the_stability_limit(jolted):
    """The limit is 2 over the largest eigenvalue of the Hessian: 10 % below converges, 10 % above does not."""
    start, minimum = jolted
    with jamlab.Session(start) as session:
        relax(session)
        largest = np.linalg.eigvalsh(jamlab.hessian(session.packing()).toarray())[-1]
    assert disks.try_overdamped_steps(start, minimum, 1.8 / largest, 5000)[0] == "converged"
    assert disks.try_overdamped_steps(start, minimum, 2.2 / largest, 5000)[0] != "converged"


def test_force_tolerance_below_rounding_is_not_called_converged(jolted):
    with jamlab.Session(jolted[0]) as session:
        found = relax(session, 1e-17)
    assert not found.converged and 1e-17 < found.evaluation.max_force < 1e-13


def test_pressures_out_of_reach_are_refused():
    for pressure in (1e-9, 0.5):
        run = attempt(16, pressure, lambda p=pressure: disks.try_pressure(16, p, True))
        assert run.verdict == "refused" and f"{pressure}" in run.note


def test_negative_modes_of_prestress_are_refused():
    """Two disks that buckle: springs in line under compression, stable only without pre-stress."""
    x = np.array([[0.05, 0.0], [0.95, 0.0], [1.85, 0.0], [0.5, 1.2], [1.4, 1.25]]) + 0.3
    p = jamlab.Packing("sp", np.diag([2.7, 3.0]), x, {"k": 1.0}, "k", np.ones(5))
    with pytest.raises(jamlab.ConvergenceError):
        jamlab.shear_modulus(p)


def test_strain_that_changes_contacts():
    p = jamlab.pack(16, 1e-3, 3, ensemble="shear-stabilized")
    assert disks.try_strain(p, 1e-9)[0] == "converged"
    assert disks.try_strain(p, 3e-2)[0] == "wrong basin"
    # shear_modulus starts there too, and halves its strain until it is the linear one
    g, linear = jamlab.shear_modulus(p, "finite-strain", strain=3e-2), jamlab.shear_modulus(p)
    assert g == pytest.approx(linear, rel=1e-2)


def test_droplets_squeezed_by_their_line_tension(jammed):
    run = attempt("gamma", "ka", lambda: droplets.try_hand_over(jammed, gamma=10.0, ka=1.0))
    assert run.verdict == "refused" and "gamma/ka" in run.note


def test_rims_too_wide_for_the_droplets(jammed):
    run = attempt("outline", 4.0, lambda: droplets.try_hand_over(jammed, delta=1.2))
    assert run.verdict == "refused" and "delta" in run.note


def test_segment_form_is_not_called_converged():
    """Its minima sit at kinks: handed over from disks it stays at forces far above the tolerance."""
    onset = jamlab.jam("sp", 4, 1)
    with pytest.raises(jamlab.ConvergenceError, match=r"did not converge|hand over at another rho"):
        bring_to(Way("dp", "segment", (6, 8)), onset, 0.9)


@pytest.mark.parametrize(
    ("name", "verdict", "said"),
    [
        ("regular", "converged", "max force"),
        ("edge of no length", "converged", "max force"),
        ("concave corners", "converged", "max force"),
        ("crosses itself", "refused", "cross each other"),
        ("clockwise", "refused", "counter-clockwise"),
        ("outlines cross", "stalled", "max force"),
    ],
)
def test_broken_shapes(name, verdict, said):
    shape, gap = droplets.shapes()[name]
    run = attempt("outline", name, lambda: try_relaxing(droplets.place_pair(shape, droplets.ring(12), gap)))
    assert (run.verdict, said in run.note) == (verdict, True)


@pytest.mark.slow
def test_spectra_of_packings_that_are_not_at_rest():
    states = spectra.states()
    assert jamlab.contacts(states["with rattlers"]).rattlers.any()
    for name in ("not at a minimum", "not jammed"):
        run = attempt("dense", name, lambda p=states[name]: spectra.try_frequency(p, 1e-2, "dense"))
        assert run.verdict == "refused", name
    kept, alone = (jamlab.complex_modulus(states[n], [1e-2]) for n in ("with rattlers", "backbone alone"))
    assert kept.storage == pytest.approx(alone.storage, rel=1e-9)


@pytest.mark.parametrize("method", ["dense", "direct", "reduced"])
def test_spectra_at_extreme_frequencies_and_without_sliding(method):
    packing = spectra.states()["backbone alone"]
    for omega, beta in ((1e-12, 1.0), (1e6, 1.0), (1e-2, 1e-12)):
        assert spectra.try_frequency(packing, omega, method, beta)[0] == "converged"


def test_a_map_is_written_and_drawn(tmp_path):
    found = stability(tmp_path, ["pressure"], quick=True)
    with (tmp_path / "stability.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == [run.verdict for run in found["pressure"]]
    assert counts(found)[0] == ["pressure", "2", "0", "0", "0", "2"]
    page = (tmp_path / "stability.html").read_text()
    assert "data:image/png" in page and "1e-08" in page
    runs = [Outcome("a", 1.0, "converged"), Outcome("b", 100.0, "refused")]
    axes = stability_figure(Map("t", "x", "y", lambda quick: runs, "m", (None, 10.0)), runs).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["a", "b"] and axes.get_yscale() == "log"
    with pytest.raises(jamlab.InputError, match="weather"):
        stability(tmp_path, ["weather"])
    assert all(chart.meaning for chart in MAPS.values())
