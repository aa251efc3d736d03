"""The elastic field: theory against closed forms, rows against the library, statements against the table that ships."""

from functools import cache

import numpy as np
import pandas as pd
import pytest
from scipy.special import jv

import jamlab
from studies.beyond import elastic_field as study
from studies.beyond import elastic_waves as waves
from studies.beyond.elastic_sheet import mean_of_zeros, screened_zero, screening, zero_in_box
from studies.reference_data import open_tables
from studies.tables import DATA


def test_an_incompressible_sheet_decorrelates_at_a_sixth_of_the_box():
    """Sum over k_y in closed form: m^2 sum 1/(m^2 + j^2)^2 = (pi/2m) coth(pi m) + (pi^2/2)/sinh^2(pi m)."""
    x, m = np.linspace(0.1, 0.3, 20001), np.arange(1, 200)[:, None]
    power = np.pi / (2 * m) / np.tanh(np.pi * m) + 0.5 * np.pi**2 / np.sinh(np.minimum(np.pi * m, 300.0)) ** 2
    low = ((power - np.pi / (2 * m)) * np.cos(2 * np.pi * m * x)).sum(axis=0)
    c = low - 0.5 * np.pi * np.log(2 * np.sin(np.pi * x))
    zero = x[np.argmax(c <= 0)]
    assert zero == pytest.approx(1 / 6 + 0.0025, abs=2e-4)
    assert zero_in_box() == pytest.approx(zero, abs=1e-3)
    assert zero_in_box(0.5) == pytest.approx(0.25, abs=2e-3)


def test_single_boxes_decorrelate_earlier_in_the_mean():
    """Random fields on a grid, by fast Fourier transform."""
    rng, side = np.random.default_rng(3), 48
    k = np.fft.fftfreq(side, 1 / side)
    x, y = np.meshgrid(k, k, indexing="ij")
    square = np.where(x**2 + y**2 > 0, x**2 + y**2, 1)
    zeros = []
    for _ in range(1500):
        field = np.fft.fft2(rng.normal(size=(side, side))) * np.sqrt(x**2 / square**2)
        c = np.fft.ifft((np.abs(field) ** 2).sum(axis=1)).real
        i = int(np.argmax(c <= 0))
        zeros.append((i - 1 + c[i - 1] / (c[i - 1] - c[i])) / side)
    mean, deviation = mean_of_zeros()
    assert np.mean(zeros) == pytest.approx(mean, abs=4 * deviation / np.sqrt(1500))
    assert mean < zero_in_box() - 0.008


@pytest.mark.parametrize("phase", [0.0, 0.4, np.pi / 4])
def test_screened_waves_decorrelate_where_bessel_functions_say(phase):
    """In an infinite sheet the angles integrate to J_0 - J_2."""
    k = np.linspace(1e-4, 60.0, 60001)
    power = k**3 * (1 / (np.exp(1j * phase) * k**2 + 1j)).real ** 2 * np.exp(-((k / 30) ** 2))

    def c(x):
        return np.trapezoid(power * (jv(0, k * x) - jv(2, k * x)), k)

    zero = screened_zero(phase)
    assert c(0.97 * zero) > 0 > c(1.03 * zero)


def test_drag_screens_waves_longer_than_the_length():
    k = np.array([0.1, 1.0, 10.0])
    assert screening(k, 2.0, 2.0) == pytest.approx(1 / (1 + k**-4.0))


def test_rows_are_the_shells_of_the_library():
    rows = pd.DataFrame(waves.measure_packing(64, 1e-2, 1, True))
    p = jamlab.pack(64, 1e-2, 1, ensemble="shear-stabilized")
    edges = waves.SHELLS * 2 * np.pi / np.sqrt(p.area)
    edges = edges[: np.searchsorted(edges, waves.K_MAX) + 1]
    omega = waves.FREQUENCIES[4] * 0.1
    for at, law in ((0.0, None), (omega, jamlab.StokesDrag())):
        for prestress in (0, 1):
            own = rows[np.isclose(rows["omega"], at) & (rows["prestress"] == prestress)]
            found = jamlab.displacement_spectrum(p, waves.K_MAX, at or None, law, prestress=bool(prestress))
            shells = found.shells(edges)
            table = own[own["shell"].notna()]
            assert table["transverse"].to_numpy() == pytest.approx(shells.transverse, rel=1e-10)
            assert table["longitudinal"].to_numpy() == pytest.approx(shells.longitudinal, rel=1e-10)
            assert table["waves"].tolist() == shells.wavevectors.tolist()
            modulus = jamlab.complex_modulus(p, omega, jamlab.StokesDrag(), prestress=bool(prestress))
            whole = waves.whole_fields(own).iloc[0]
            if law is None:  # what drag dissipates beside the fluid
                assert whole["viscosity"] == pytest.approx(modulus.eta0 - 1.0, rel=1e-6)
                assert whole["storage"] == pytest.approx(modulus.g0, rel=1e-6)
            else:
                assert whole["storage"] == pytest.approx(modulus.storage[0], rel=1e-6)


def test_heights_and_angles_of_a_known_spectrum():
    """S_T = 3 (1 + 0.3 cos 4 theta)/k^2 and S_L = 0.1 S_T at n = 2 and p = 1e-2."""
    k, across = np.array([0.1, 0.1 * 2**0.5, 0.3, 2.0]), 3 * np.array([1.3, 0.7, 1.0, 50.0])
    who = {"n": 1024, "pressure": 1e-2, "seed": 1, "prestress": 0, "omega": 0.0}
    parts = {"shell": [1, 2, 3, 4], "k": k, "waves": [2, 2, 20, 400]}
    rows = pd.concat([
        pd.DataFrame([who | {"area": 10.0, "backbone": 20, "box": 1.0, "length": 0.1, "square": 1.0}]),
        pd.DataFrame(parts | {"transverse": across / k**2, "longitudinal": 0.1 * across / k**2}).assign(**who),
    ])  # fmt: skip
    shells = waves.shells_of(rows)
    assert study.fourfold(shells) == pytest.approx(0.3)
    long = study.over_long_waves(shells)
    weight = np.array([2, 2, 20]) / k[:3] ** 2
    assert long["c"].item() == pytest.approx(2 * 1.1 * 0.1 * (weight @ across[:3]) / weight.sum())


def test_a_slope_that_was_put_in_is_found():
    rng = np.random.default_rng(2)
    n = np.repeat([128, 512, 2048, 8192], 40)
    rows = pd.DataFrame({"n": n, "pressure": 1e-2, "y": 0.2 + 0.03 * np.log(n / 1024) + rng.normal(0, 0.02, len(n))})
    found = study.by_logarithm(study.means_by_size(rows, "y"), 0.03)
    assert found["B"] == pytest.approx(0.03, abs=4 * found["error"])
    assert found["theory"] < 12 < found["constant"] and found["sizes"] == 4


@cache
def drawn():
    return study.draw_elastic_field(open_tables(DATA))


def test_zeros_over_the_box_are_those_of_the_sheet():
    means = study.zeros_of_boxes(waves.whole_fields(open_tables(DATA).read(study.NAME)))
    for _, own in means[means["n"] >= study.LARGE].groupby("prestress"):
        weight = own["sem"] ** -2
        mean, error = (weight * own["mean"]).sum() / weight.sum(), weight.sum() ** -0.5
        assert abs(mean - mean_of_zeros()[0]) < 3 * error
        assert mean < study.QUARTER - 10 * error


def test_lengths_under_drag_follow_the_screening_length():
    left = study.scatter(study.stokes_lengths(open_tables(DATA), 32768))
    assert left["l_s"] < 0.05 and left["published"] > 5 * left["l_s"] and left["l_s"] < left["theory"] < 0.15


def test_viscosities_grow_with_the_logarithm_of_n_under_drag_alone():
    tables = open_tables(DATA)
    found = study.slopes(tables, waves.shells_of(tables.read(study.NAME)))
    found = found[found["pressure"] > 5e-4]
    for row in found[found["damping"] == "stokes"].itertuples():
        assert row.B > 5 * row.error and row.constant > 10 * row.free
        assert abs(row.B - row.c) < 3 * np.hypot(row.error, row.c_error)
    assert (
        found.loc[found["damping"] == "contact", "B"] < 0.2 * found.loc[found["damping"] == "stokes", "B"].min()
    ).all()


def test_the_figure_shows_all_points():
    figure = drawn()
    assert len(figure.table["panel"].unique()) == 6 and len(figure.text[0].rows) >= 8
