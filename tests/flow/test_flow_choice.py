"""The least model of a flow: what is promised, what is chosen, and whether a run agrees."""

import re

import numpy as np
import pytest

import jamlab
from jamlab.estimates.choice import Why
from jamlab.estimates.flow_choice import FLOW_PLAN
from jamlab.estimates.flow_errors import CONDITIONS, FlowCondition, shipped_errors
from jamlab.statistics.confidence import STANDARD_ERRORS
from studies.flow_errors import STEADY

FILM = jamlab.ContactDamping(alpha=0.5)


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=64, pressure=1e-2, seed=1)


def options(choice, column="error"):
    return dict(zip(choice.options["way"], choice.options[column], strict=True))


def bound(choice):
    return next(iter(choice.bound.values()))


def complex_of(result):
    return complex(result.storage[0], result.loss[0]) if hasattr(result, "storage") else complex(result)


@pytest.mark.parametrize(
    ("way", "law", "given"),
    [
        ("static modulus", None, {"omega": 1e-8}),
        ("linear spectrum", None, {"omega": 1.0, "amplitude": 1e-4, "error": 0.05}),
        ("linear spectrum", jamlab.StokesDrag(), {"omega": 1.0}),
        (
            "equivalent damping",
            jamlab.ContactDamping(1.0, 2.0, 0.9),
            {"omega": 3.0, "amplitude": 1e-4, "error": 0.2},
        ),
        ("oscillation", None, {"omega": 1.0, "amplitude": 0.1}),
        ("oscillation", FILM, {"omega": 1e-8, "amplitude": 1e-3}),
        ("flow", None, {"rate": 1e-2, "error": 0.2}),
        ("linear flow", FILM, {"rate": 1e-3, "error": 0.3}),
    ],
)
def test_each_way_calls_a_public_function_that_gives_what_it_says(packing, way, law, given):
    """The modulus of a choice is that of its call; a run is not run here, but can be called, and prints as written."""
    choice = jamlab.choose_flow(packing, law, **given)
    name = choice.function.__name__
    assert choice.way == way and getattr(jamlab, name) is choice.function and name in jamlab.__all__
    assert choice.call.startswith(f"jamlab.{name}(p") and choice.call in repr(choice)
    assert options(choice, "why")[way] == Why.TAKEN and options(choice)[way] == bound(choice)
    assert choice.strain == (options(choice, "strain")[way] if way in ("oscillation", "flow", "linear flow") else 0)
    if choice.modulus is not None:
        assert complex_of(choice.run(packing)) == pytest.approx(choice.modulus, rel=1e-6)
        assert complex_of(eval(choice.call, {"jamlab": jamlab, "p": packing})) == pytest.approx(
            choice.modulus, rel=2e-3
        )
    else:
        assert {"amplitude", "rates"} & set(choice.arguments)


def test_small_strains_need_the_linear_spectrum_and_a_run_agrees(packing):
    choice = jamlab.choose_flow(packing, omega=1.0, amplitude=1e-4, error=0.05)
    run = jamlab.oscillate(packing, 1.0, 1e-4, cycles=3, tolerance=5e-3)
    true = complex(run.storage, run.loss)
    assert abs(choice.modulus - true) <= bound(choice) * abs(true)
    assert options(choice)["static modulus"] > 0.05 and not choice.outside


@pytest.mark.slow
def test_where_nothing_was_measured_the_answer_is_a_run(packing):
    """Strains beyond the table, films slower than it, particles, pressures, beta and droplets unlike its own."""
    small, loose = jamlab.pack(n=32, pressure=5e-3, seed=1), jamlab.pack(n=64, pressure=1e-3, seed=1)
    droplets = jamlab.droplets_from_disks(next(jamlab.compress(jamlab.jam(8, "sp", 1), 0.87, 0.1)))
    cases = [(packing, None, 0.1, "")]
    cases += [(packing, FILM, 1e-3, "drag over elasticity = 0.0032")]
    cases += [(small, None, 1e-4, "particles = 32")]
    cases += [(loose, None, 1e-6, "pressure over stiffness = 0.001")]
    cases += [(packing, jamlab.ContactDamping(0.5), 1e-4, "beta = 0.5")]
    cases += [(packing, jamlab.ContactDamping(alpha=0.4), 1e-4, "alpha = 0.4")]
    cases += [(droplets, None, 1e-4, "model = dp")]
    for p, law, amplitude, named in cases:
        choice = jamlab.choose_flow(p, law, omega=1.0 if law is not FILM else 1e-8, amplitude=amplitude)
        assert choice.way == "oscillation" and choice.modulus is None
        assert options(choice)["linear spectrum"] == np.inf and options(choice, "why")["linear spectrum"] == Why.UNKNOWN
        assert named in "; ".join(map(str, choice.outside))
        assert named in repr(choice)
    assert jamlab.choose_flow(small, omega=1.0).way == "linear spectrum"  # infinitely small strains need no table


@pytest.mark.parametrize(
    ("law", "rate", "named"),
    [
        (jamlab.ContactDamping(), 1e-5, "= 1e-05"),
        (jamlab.ContactDamping(), 500.0, "= 5e+02"),
        (jamlab.StokesDrag(), 1e-2, "drag = Stokes"),
        (jamlab.ContactDamping(alpha=0.4), 1e-3, "alpha = 0.4"),
        (jamlab.ContactDamping(2.0, alpha=0.9), 1e-2, "beta = 2"),
        (jamlab.ContactDamping(tau=10.0), 0.1, "= 1,"),
        (FILM, 2e-2, "= 0.14"),
    ],
)
def test_steady_flow_outside_the_table_is_refused_by_name(packing, law, rate, named):
    """Nobody measured how far its average scatters."""
    with pytest.raises(jamlab.InputError, match=re.escape(named)):
        jamlab.choose_flow(packing, law, rate=rate, error=0.3)


def test_steady_flow(packing):
    """Half the 95 % interval of the average, over more strain or more disks, fills what the run itself leaves."""
    fast, slow = (jamlab.choose_flow(packing, rate=1e-2, error=t) for t in (0.2, 0.02))
    wide = jamlab.choose_flow(jamlab.pack(n=128, pressure=1e-2, seed=1), rate=1e-2, error=0.02)
    for choice, n in ((fast, 64), (slow, 64), (wide, 128)):
        noise = STANDARD_ERRORS * shipped_errors().scatter_of_flow * np.sqrt(CONDITIONS.size / n / (choice.strain - 1))
        assert bound(choice) == pytest.approx(np.hypot(FLOW_PLAN.error, noise))
    assert 0.99 * 0.2 < bound(fast) <= 0.2 and 0.99 * 0.02 < bound(slow) <= 0.02 and 0.99 * 0.02 < bound(wide) <= 0.02


def test_linear_flow_shares_its_error_with_its_average(packing):
    """Else its error and that of the average, each as large as allowed, would add up to more."""
    model = shipped_errors().promise(FlowCondition("flow", 0.5, 1e-3**0.5))
    for error in (1.5 * model, 1.05 * model):
        choice = jamlab.choose_flow(packing, FILM, rate=1e-3, error=error)
        noise = STANDARD_ERRORS * shipped_errors().scatter_of_flow / np.sqrt(choice.strain - 1)
        assert choice.way == "linear flow" and bound(choice) <= error
        assert bound(choice) == pytest.approx(np.hypot(model, noise))
        assert choice.arguments["rates"] == [pytest.approx(1e-3**0.5)]
    for error in (0.9 * model, model * (1 + 1e-6)):  # near its own error nothing is left for the average
        refused = jamlab.choose_flow(packing, FILM, rate=1e-3, error=error)
        assert refused.way == "flow" and options(refused)["linear flow"] > error >= bound(refused)
        assert refused.strain <= FLOW_PLAN.strain
    with pytest.raises(jamlab.InputError, match=r"error = 0\.011"):
        jamlab.choose_flow(packing, rate=1e-2, error=FLOW_PLAN.error * 1.1)


def test_steady_flow_runs_as_its_errors_were_measured(packing):
    film = jamlab.choose_flow(packing, FILM, rate=1e-3, error=0.4)
    curve = film.run(packing)
    assert curve.background_drag == STEADY["background_drag"] == CONDITIONS.background
    assert curve.strain + curve.discard == pytest.approx(film.strain)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({}, "omega = None, rate = None"),
        ({"omega": 1.0, "rate": 1.0}, "rate = 1.0"),
        ({"omega": 1.0, "damping": FILM}, "α = 0.5"),
        ({"omega": 1.0, "error": 1e-4}, "error = 0.0001"),
        ({"rate": 0.0}, "rate = 0.0"),
    ],
)
def test_refused(packing, given, named):
    with pytest.raises(jamlab.InputError, match=named):
        jamlab.choose_flow(packing, **given)
