"""Results say themselves how well energy is balanced, and warn where it is not."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.flow.flow_run import energy_imbalance

RUNS = {
    "shear": lambda p: jamlab.shear(p, 0.1, 0.1, rows=10),
    "quasi-static": lambda p: jamlab.quasistatic_shear(p, 2e-3, strain_step=1e-3),
    "oscillate": lambda p: jamlab.oscillate(p, 1.0, 1e-3, cycles=2),
    "creep": lambda p: jamlab.creep(p, 1e-4, 5.0),
    "relax-stress": lambda p: jamlab.relax_stress(p, 1e-3, 5.0),
    "flow-curve": lambda p: jamlab.flow_curve(p, [0.3], strain=1.0, discard=0.2),
}


@pytest.mark.parametrize("kind", RUNS)
def test_every_result_carries_its_imbalance_and_warns(disks, kind):
    """The same run with a part of its energy left out is flagged wherever it is shown."""
    run = RUNS[kind](disks)
    assert np.max(run.energy_error) < 0.01
    if kind == "flow-curve":
        off = replace(run, energy_error=run.energy_error + 0.05)
    else:  # energy appears from nowhere
        scale = max(np.abs(values - values[0]).max() for values in (run.work, run.dissipated))
        ramp = 0.05 * scale * np.linspace(0, 1, len(run.energy))
        off = replace(run, energy=run.energy + ramp)
        gap = run.energy_gap - ramp
        assert off.energy_gap == pytest.approx(gap, rel=1e-9, abs=1e-9 * scale)
        assert off.energy_error == pytest.approx(np.abs(gap).max() / scale, rel=1e-9)
        assert run.balanced and not off.balanced
    remedy = {"strain_step": 5e-4} if kind == "quasi-static" else {"tolerance": pytest.approx(0.1 * run.tolerance)}
    assert off.remedy == remedy
    (name, value) = next(iter(off.remedy.items()))
    assert f"{name} = {value:g}" in off.conclusion and f"{name} = {value:g}" not in run.conclusion
    percent = f"{100 * np.max(off.energy_error):.2g} %"
    assert off.conclusion in repr(off) and percent in off.conclusion
    titles = [_balance(result.plot()) for result in (run, off)]
    assert percent in titles[1] != titles[0]


def _balance(axes):
    """What a picture says of energy: on its right, or over its legend."""
    return axes.get_title("right") or axes.get_legend().get_title().get_text()


def test_droplets_that_snap_without_drag_are_told_a_background():
    """What they lose without drag no finer step finds: a tenth of the tolerance leaves it as large."""
    relax = partial(jamlab.relax_stress, jamlab.jam(2, "dp", 1), 1e-3, 1.0)
    off, finer = relax(), relax(tolerance=1e-4)
    assert min(off.energy_error, finer.energy_error) > 100 * off.tolerance
    assert off.remedy == {"background_drag": 1e-2}
    assert relax(**off.remedy).energy_error < 1e-3 * off.energy_error


@pytest.mark.parametrize(
    ("rate", "tolerance", "strain", "law"),
    [
        (0.1, 1e-2, 0.4, None),  # beyond 0.36 an edge has shrunk to a point: 17 tolerances where it keeps its tension
        (0.1, 1e-3, 0.1, None),  # 0.6 tolerances where no step is taken again
        pytest.param(0.01, 1e-3, 0.4, None, marks=pytest.mark.slow),
        pytest.param(1e-3, 1e-3, 0.4, None, marks=pytest.mark.slow),
        pytest.param(0.1, 1e-3, 0.4, jamlab.StokesDrag(eta_f=0.0), marks=pytest.mark.slow),
    ],
)
def test_droplets_that_slip_balance_energy_to_the_tolerance(rate, tolerance, strain, law):
    """Vertices that slip past others dissipate in bursts: a step that misses one is taken again, shorter.

    So is one that loses little, where all steps so far have lost what the tolerance allows.
    """
    droplets = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    run = jamlab.shear(droplets, rate, strain, law, rows=50, tolerance=tolerance)
    assert run.energy_error < tolerance / 3 and run.balanced


def test_creep_of_droplets_balances_energy():
    """Their response to the shear rate nearly cancels it: velocities that look accurate lost half of the work."""
    droplets = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    run = jamlab.creep(droplets, 1e-5, 0.5, tolerance=1e-2, background_drag=1e-2)
    assert run.energy_error < 1e-2 and run.balanced


def test_what_energy_rounds_off_is_no_imbalance():
    """A row of disks that nothing pushes aside takes no work, but holds an energy."""
    row = np.column_stack([np.arange(40.0), np.full(40, 0.6)])
    strip = jamlab.Packing("sp", [[40.0, 0], [0, 1.2]], row, {"k": 1.0}, "k", np.full(40, 1.01))
    run = jamlab.shear(strip, 1.0, 0.02, rows=2)
    assert run.energy[0] > 1e-5 and run.energy_error == 0
    assert energy_imbalance(np.zeros(2), np.ones(2), np.ones(2)) == 0
