"""Numbers of the papers from tables in which the papers' laws hold, and the table of statements."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from drawn_figures import TABLES, tables
from paper_tables import onset, quasistatic, spectra, states

from jamlab.errors import InputError
from studies import pages
from studies.beyond.droplet_voids import three_disks
from studies.ensemble_tables import PACKINGS, EnsembleTables, droplets_above_onset
from studies.ensembles import Sample, bootstrap, select
from studies.papers import statements as paper_statements
from studies.papers.baumgarten.spectra import regime_ends, wide_spectra
from studies.papers.boromand.contacts_and_modulus import exponent_less, over_table_2
from studies.papers.boromand.conventions import SUBTRACTED, curve, curve_near_onset, eq_11, even_places, table_fit
from studies.papers.boromand.geometry import late_onset
from studies.papers.boromand.onset_and_confluence import left_at_confluence
from studies.papers.boromand.voids import beyond, of_rims, triangle_shape, void_sums
from studies.papers.headline import ours, with_error
from studies.papers.statements import UNTESTED, Measured, analyse, explanations, find, measure, paper, statements
from studies.papers.verdicts import NORMAL, compare
from studies.reference_data import open_tables

ROOT = Path(__file__).parents[2]
VARIANTS = "factor=2; factor=3; twice=2"


@pytest.mark.parametrize(
    ("statement", "value", "tolerance"),
    [
        *(("B4-C", 1.0, 1e-3), ("B6-alpha0", 0.5, 0.02), ("B6-beta0", 0.5, 0.01), ("B6-a", 2.0, 0.02)),
        *(("B8-P3-sp", 0.4, 1e-9), ("B8-P5-dp", 0.2, 1e-9), ("B8-P3-dense-dp", 1.0, 1e-9)),
        *(("B8-A3-dense-dp", 4.87, 1e-9), ("B10-theta-sp", 0.55, 1e-6), ("B10-onset-dp", 0.842, 1e-6)),
        *(("B11-kappa", 0.75, 1e-3), ("B11-overlap", 1.5, 1e-3), ("B11-energy", 0.5, 1e-3)),
        *(("B11-omega-small-sp", 2 / 3, 1e-3), ("B11-omega-small-dp", 1.0, 1e-3), ("BT-z0-sp-phi", 3.7, 0.07)),
        *(("BT-G0-sp-phi", 0.42, 0.005), ("BT-z0-dp", 3.3, 0.05), ("BT-z1-dp", 7.1, 0.1), ("BT-G1-dp", 1.7, 0.02)),
        *(("BT-z-dp-05", 5.0629, 1e-3), ("BT-z-dp-10", 5.7236, 1e-3), ("BT-z-dp-15", 6.3131, 1e-3)),
        *(("T3-mu", 0.5, 0.02), ("T3-lambda", 1.0, 0.05), ("T4-beta-star", 1.0, 1e-6), ("T5-approach", 0.25, 0.01)),
        *(("T5-sliding-stressed", -0.25, 0.01), ("T5-mean-sliding", 0.0, 1e-9), ("T5-rms-sliding", -0.25, 0.01)),
        *(("T6-lambda", 1.0, 0.02), ("T7-length-stokes", 0.25, 0.01), ("T7-length-decades", 1.0, 0.05)),
        *(("T7-logarithm", 0.65, 0.02), ("T7-imaginary", 1.5, 1e-9), ("T8-a-contact", 1.0, 0.02)),
        *(("flow-softening", 1.0, 0.05),),
    ],
)
def test_numbers_are_what_the_tables_hold(statement, value, tolerance):
    found = measure(statement, tables())
    assert found.value == pytest.approx(value, abs=tolerance)
    assert found.low - 1e-12 <= found.value <= found.high + 1e-12


def test_the_loss_of_the_fluid_alone_is_no_critical_slope():
    """G'' of a fluid of viscosity 1 rises with omega; what it adds to G'' ~ omega^0.5 is taken off. G'' itself, which
    the paper collapses, is another analysis, as G' is beside G' - G_0."""
    table = TABLES["spectra"]()
    fluid = (table["damping"] == "stokes") & (table["eta_f"] == 1)
    table.loc[fluid, "loss"] += table.loc[fluid, "omega"]
    found = measure("T6-Delta-loss", EnsembleTables({"spectra": table}.get))
    assert found.value == pytest.approx(0.5, abs=0.02)
    assert found.variants["part = G''"].value > 0.54


def test_another_size_is_another_analysis():
    """Two sizes with other exponents: the larger is the number."""
    given = EnsembleTables({"quasistatic": quasistatic({512: 0.1, 32_768: 0.3})}.get)
    found = measure("T5-mean-approach", given)
    assert found.value == pytest.approx(0.3, abs=0.01)
    assert found.variants["n = 512"].value == pytest.approx(0.1, abs=0.01)
    assert measure("T5-sheared", given).value == pytest.approx(-0.3, abs=0.01)


def test_sizes_beside_the_papers_move_no_number():
    """Six packings of N = 1024 of any width, and a few that reach confluence."""
    table = onset()
    few = table[(table["n"] == 128) & (table["seed"] < 6)].assign(n=1024)
    begun = EnsembleTables({"onset": pd.concat([table, few], ignore_index=True)}.get)
    assert measure("B10-theta-sp", begun) == measure("B10-theta-sp", tables())
    more = states(sizes=(1024,)).assign(z=5.0)
    both = EnsembleTables({"states": pd.concat([states(), states("dp"), more], ignore_index=True)}.get)
    for statement in ("B7-collapse-sp", "B6-a"):
        assert measure(statement, both).value == measure(statement, tables()).value


def test_contacts_of_droplets_have_a_second_count():
    """A tenth of the contacts of droplets only stop one; what a table has for disks there does not count."""
    table = TABLES["states"]()
    starts = TABLES["onset_starts"]()
    own = {
        "states": table.assign(z_strong=0.9 * table["z"]),
        "onset_starts": starts.assign(z_strong=0.9 * starts["z_J"]),
    }
    given = EnsembleTables({**own, "onset": onset()}.get)
    for statement in ("BT-zJ-dp", "B5-z-models"):
        found = measure(statement, given)
        assert found.variants["count = strong"].value == pytest.approx(0.9 * found.value)
    assert "count = strong" not in measure("B5-z-models", tables()).variants


def test_a_collapse_ends_at_the_highest_pressure_of_the_paper():
    """Beyond 0.01 viscosity grows with pressure (first term of eq 22), which no collapse in p N^2 knows."""
    table = spectra()
    dense = table["target_pressure"] == 0.1
    wrong = EnsembleTables({"spectra": table.assign(eta0=table["eta0"] * np.where(dense, 5, 1))}.get)
    found, right = (measure("T8-a-contact", given) for given in (wrong, tables()))
    assert (found.value, found.low, found.high) == (right.value, right.low, right.high)
    assert found.variants["highest = 0.1"].value < 0.95 * found.value


def test_regimes_of_root_laws_end_where_they_cross():
    """G'' = omega^0.5 meets eta_0 omega at 0.3 p and eta_inf omega at 2, whatever the packings' common factor."""
    pressures, omega = [1e-4, 1e-3, 1e-2], np.geomspace(1e-3, 10, 401)
    numbers = [[(0.3 * p) ** -0.5, 2**-0.5, *omega**0.5] for p in pressures]
    drawn = [np.outer([0.8, 1.2], row) for row in numbers]
    ends = regime_ends(pressures, [omega] * 3, drawn)
    assert ends == pytest.approx([0, np.log10(0.3), np.log10(2)], abs=1e-4)


# how a number is measured ---------------------------------------------------------------------------------------------


def thirty(given, twice=1.0):
    """A sample: the packings, or twice as large."""
    return Sample([twice * given])


def mean(groups, factor=1.0):
    """Average. And more."""
    if factor > 2:
        raise InputError("too large")
    return factor * groups[0].mean()


def test_other_analyses_have_the_interval_of_their_own_packings(monkeypatch):
    monkeypatch.setattr(paper_statements, "find", {"mean": mean, "thirty": thirty}.get)
    row = replace(statements()["B4-C"], statistic="mean", sample="thirty", settings="", variants=VARIANTS)
    packings = np.random.default_rng(1).normal(3.0, 1.0, 30)
    (found,) = analyse(row, packings)
    alone = bootstrap([packings], lambda g: g[0].mean())
    assert (found.value, found.low, found.high) == (alone.value, alone.low, alone.high)
    assert list(found.variants) == ["factor = 2", "twice = 2"]  # one that fails is left out
    for other in found.variants.values():
        assert [other.value, other.low, other.high] == pytest.approx([2 * alone.value, 2 * alone.low, 2 * alone.high])
    assert found.systematic == pytest.approx((0, float(alone.value))) and found.how == "Average"


def test_exponents_of_both_models_and_curves_over_fits_by_hand():
    x = np.geomspace(1e-3, 0.15, 30)
    assert exponent_less((x, 2 * x**0.7), (x, x**0.5), low=0.01) == pytest.approx(0.2)
    assert over_table_2(x, 1.1 * (0.38 * x**0.5 + 0.35 * x), "SP(ρ)", 0.05) == pytest.approx(1.1, rel=1e-3)
    z = statements()["BT-z-dp-10"]  # 3.97 + 3.3 d^0.5 + 7.1 d, and half of the last digits of all three
    assert z.value == pytest.approx(3.97 + 3.3 * 0.1**0.5 + 0.71) and z.margin == pytest.approx(0.0258, abs=1e-4)


def test_rims_of_another_width_are_another_analysis_of_voids():
    """By hand, two packings at two fractions: 2 voids of three sides with sums 6 and 10, one of four; and those that
    ship: rims of their own width bound the voids of the packings that are counted elsewhere."""
    rows = pd.DataFrame({"seed": [1, 1, 2], "rho": [0.975, 0.985, 0.985], "sides": [3, 3, 4], "width": 0.98})
    rows = rows.assign(voids=[2, 2, 1], area=0.1, shape_factor=[6.0, 10.0, 1.5])
    rho, cube = of_rims(pd.concat([rows, rows.assign(width=1.0)]), 0.98)
    assert beyond(rho, cube, "shape", 0.97) == pytest.approx(4.0) and beyond(rho, cube, "shape", 0.98) == 5.0
    assert beyond(rho, cube, "share", 0.98) == pytest.approx(2 / 3)
    table = open_tables().read("droplet-rims")
    shapes = [float(beyond(*of_rims(table, width), "shape", 0.97)) for width in (0.96, 0.98, 1.0, 1.02, 1.04)]
    assert shapes == sorted(shapes, reverse=True)
    assert shapes[2] == pytest.approx(float(beyond(*void_sums(open_tables(), "dp", False), "shape", 0.97)), rel=0.01)


def test_droplets_that_are_followed_near_onset_only_take_part_where_they_are_known():
    """Beyond, a curve goes on with the others; without that table it is that of the states."""
    given = tables()
    alone = EnsembleTables({"states": TABLES["states"]()}.__getitem__)
    of = {"model": "dp", "n": 128, "x": "d_rho", "y": "d_z", "places": "CROSSOVER"}
    (more,), (few,), (plain,) = (
        s.groups for s in (curve_near_onset(given, **of), curve_near_onset(alone, **of), curve(alone, **of))
    )
    assert np.array_equal(few, plain, equal_nan=True) and len(more) == 2 * len(few)
    x = curve_near_onset(given, **of).reduce([more])[0]
    known = np.isfinite(more[len(few) :]).all(axis=0)
    assert x[known].max() == pytest.approx(1.6e-3, rel=0.3) and len(x) == few.shape[1] and not known.all()
    states = TABLES["states"]()
    assert droplets_above_onset(states[states["rho"] - states["rho_J"] < 2e-3])["model"].unique().tolist() == ["dp"]
    assert droplets_above_onset(states).empty


def test_contacts_of_droplets_move_with_the_force_law():
    """By what the law with most or least contacts, of those with four packings of N = 64, has more than the usual."""
    given = open_tables()
    found = measure("BT-z-dp-10", given)
    laws = given.droplet_laws.query("n == 64").groupby(["gamma", "delta", "eps", "nv_small"])["z_010"]
    z = laws.mean()[laws.count() >= 4]
    off = {name: float(found.variants[f"law = {name}"].value) - found.value for name in ("most", "least")}
    usual = z[0.4, 0.25, 1.0, 12]
    assert len(z) == 14 and off == pytest.approx({"most": z.max() - usual, "least": z.min() - usual})


def test_what_tables_lack_is_told():
    starts = TABLES["onset_starts"]().query("start == 'from-disks'")
    given = {"onset": onset().query("model == 'sp'"), "onset_starts": starts}
    none = EnsembleTables(given.__getitem__)
    found = measure("B10-theta-dp", none)
    assert not found.known and "dp" in found.lacking
    assert not Measured().known


# statements -----------------------------------------------------------------------------------------------------------


def test_every_statement_is_measured_and_every_measurement_is_of_a_statement():
    apart = {"B9-z-experiments", "B9-rho-experiments"}  # no data
    for name, s in statements().items():
        assert s.statistic or not s.listed or name in apart
        assert all(callable(find(function)) for function in (s.statistic, s.sample) if function)
    assert set(explanations()) <= set(statements())
    assert {s.stated for s in statements().values()} <= {
        *("stated", "fit", "line", "read", "share", "word", "about", "order", "theory", "bound", "digits", "")
    }
    for s in statements().values():
        assert s.stated or not s.listed
        assert s.no_test in ("", *UNTESTED)
        assert (s.relation == "=") == (s.stated != "bound") or not s.stated


def test_explanations_name_the_papers_own_numbers():
    """By hand: 3.7 sqrt(0.129) = 1.33 at drho = 0.1; z = 6 by row DP(ρ) at 0.958; single exponents 0.66 and 0.92."""
    d_phi = np.linspace(0, 0.4, 4001)
    same = np.interp(0.1, paper("B4-C") * eq_11(d_phi), d_phi)
    assert [float(table_fit("SP(φ)", "z")(same)), paper("BT-z-sp-rho")] == pytest.approx([1.33, 1.22], abs=5e-3)
    d = np.linspace(0.1, 0.2, 10_001)
    full = paper("BT-rhoJ-dp") + np.interp(6 - paper("BT-zJ-dp"), table_fit("DP(ρ)", "z")(d), d)
    assert full == pytest.approx(0.958, abs=5e-4)
    x = even_places("dp", "d_rho")
    slopes = [np.polyfit(np.log(x), np.log(table_fit("DP(ρ)", name)(x)), 1)[0] for name in ("z", "G")]
    assert slopes == pytest.approx([0.66, 0.92], abs=5e-3)
    text = explanations()
    assert "1.33" in text["BT-z-sp-rho"] and "0.958" in text["BT-z-dp-10"]
    assert "0.66" in text["B6-z-single-dp"] and "0.92" in text["B6-g-single-dp"]


# the page -------------------------------------------------------------------------------------------------------------


def number(name, given, of=""):
    """A number as it is measured, or by another analysis."""
    found = measure(name, given)
    return float(found.variants[of].value if of else found.value)


def known(name, given, of=""):
    """A number with the standard error of its packings, as it is measured or by another analysis."""
    found = measure(name, given)
    one = found.variants[of] if of else found
    return with_error(float(one.value), float(one.high - one.low) / NORMAL)


def lengths(table, reduced=0.0056):
    """l at one reduced frequency of figure 7 d, pressures descending."""
    curves = [part for _, part in table.query("panel == 'd'").groupby("series", sort=False)]
    scaled = [np.exp(np.interp(np.log(reduced), np.log(part["x"]), np.log(part["y"]))) for part in curves]
    return [y / (-np.log(p)) ** paper("T7-logarithm") for y, p in zip(scaled, (1e-2, 1e-3, 1e-4), strict=True)]


def told(given):
    """Sentences of the page, from the data."""
    bound = pages.draw("baumgarten-5", given).table.query("panel == 'b'").groupby("series")["y"].agg(["max", "min"])
    small, large = (bound.filter(like=name, axis=0).to_numpy()[0] for name in ("512", "32768"))
    yield f"falls from {small[0]:.2f} at *p* = 10⁻² to {large[1]:.3f} at 10⁻⁶"
    yield f"with an exponent of {number('T5-mean-approach', given):.2f}"
    omega = {float(late): near for late, near, _ in late_onset(given).rows}
    late = f"{omega[1e-4]}, {omega[1e-3]} and {omega[1e-2]} with Δ₀ = 10⁻⁴, 10⁻³ and 10⁻²"
    yield f"then ω is {late}, without it {omega[0.0]}"
    claims = {c.statement.id: c for c in compare("baumgarten-7", given)}
    yield f"Our plateau is {ours(claims['T7-length-stokes'])} *L*"
    length = lengths(pages.draw("baumgarten-7", given).table)
    yield f"our *l* grows from {length[0]:.1f} to {length[-1]:.1f} d"
    yield f"lowers it by a factor of {2 ** paper('T7-logarithm'):.1f}"
    rho, cube = void_sums(given, "dp", False)
    onset = triangle_shape(void_sums(given, "dp", True)[1].sum(axis=(0, 1)))
    dense = beyond(rho, cube, "shape", 0.895 - 0.004, 0.895 + 0.004)
    yield f"Ours is {onset:.2f} at onset, {dense:.1f} at ρ = 0.90 and {number('B8-A3-dense-dp', given):.2f} beyond 0.97"
    yield f"overlap by 1 % of their diameter have {three_disks(0.01)[1]:.2f}"
    thin = [number("B8-A3-dense-dp", given, f"rims = {width}") for width in (0.98, 0.96)]
    yield "rims 2 % and 4 % thinner, have {:.2f} and {:.2f}".format(*thin)
    laws = select(given.droplet_laws, n=64).dropna(subset="void_090").groupby(["delta", "eps", "nv_small"])
    z = laws["z_010"].agg(["mean", "sem"]).dropna()  # one packing is no mean
    most, same = (with_error(*row) for row in (z.loc[z["mean"].idxmax()], z.loc[0.25, 1.0, 12]))
    yield f"= {float(SUBTRACTED + table_fit('DP(ρ)', 'z')(0.1)):.2f}$ at $d"
    yield f"Ours is {known('BT-z-dp-10', given)} at N = 256."
    yield f"Of {len(z)} sets of γ, δ and vertices none exceeds {most} at N = 64"
    yield f"our usual set has {same}."
    _, along_x, sheared = PACKINGS
    chosen = ("", f"packings = {along_x}", f"packings = {sheared}")
    found = [known("BT-G0-sp-phi", given, of) for of in chosen]
    yield "Ours is {} for all packings of N = 256, {} for packings with $G_x > 0$, and {} for [shear".format(*found)
    yield "So does the ratio of G at N = 256 and 32 (Δρ = 0.1): {}, {}, {}".format(
        *(known("B5-g-sizes-sp", given, of) for of in chosen)
    )
    starts = pages.draw("onset-starts", given).values
    small, large = (starts[f"direct less disks, N = {n}: mean"] for n in (32, 256))
    yield f"by {float(small.value):.4f} [{float(small.low):.4f}, {float(small.high):.4f}] (95 %) at N = 32."
    yield f"At 256 both agree to {max(-float(large.low), float(large.high)):.4f}"
    confluent = [1 - group.mean() for group in left_at_confluence(given).groups]
    yield f"Our usual droplets reach *z* = 6 at {min(confluent):.3f} to {max(confluent):.3f}"
    yield f"Below Δφ = {(1 - 1 / paper('B11-C-onset')) ** 2:.2f} this C gives"
    yield f"Our C is {number('B4-C', given):.2f} above 0.01 and {number('B11-C-onset', given):.2f} below"


@pytest.mark.slow
def test_the_page_says_what_the_data_hold():
    given = open_tables()
    page = (ROOT / "docs" / "explanation" / "papers.md").read_text(encoding="utf-8")
    page = " ".join(page.split())
    assert not [sentence for sentence in told(given) if sentence not in page]
    parts = [f"{number('B5-z-parts', given, of):.2f}" for of in ("", "share = 0.03")]
    limits = (ROOT / "docs" / "explanation" / "limits.md").read_text(encoding="utf-8")
    assert "2 % above {} and 3 % above {}".format(*parts) in " ".join(limits.split())
    exponents = ("T3-mu", "T3-lambda", "T3-Delta-storage", "T3-Delta-loss", "T8-a-contact", "T4-beta-star")
    assert max(abs(number(name, given) / paper(name) - 1) for name in exponents) < 0.12
    sample = wide_spectra(given, prestress=False)
    assert f"{regime_ends(*sample.reduce(list(sample.groups)))[1]:.2f} decades" in explanations()["T3-quasistatic-end"]
