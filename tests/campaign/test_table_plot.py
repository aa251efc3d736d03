"""Plots of a campaign's tables: points are means over packings, bars standard errors, and nothing vanishes unsaid."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from scipy.special import stdtrit

import jamlab
from jamlab.campaign.tables import choose_bins, draw_means


def plotted(campaign, *args, **kwargs):
    axes = campaign.plot(*args, ax=Figure().subplots(), **kwargs)
    return axes, [text.get_text() for text in axes.get_legend().get_texts()]


def test_points_are_means_over_packings_with_their_standard_errors(full):
    axes, entries = plotted(full, "pressure", along="rho", sweep="up", bins=[0.85, 0.87, 0.9])
    states = full.table("states", sweep="up")
    states = states[states["converged"].astype(bool) & (states["n"] == 8)]  # sizes have a curve each
    assert len(axes.containers) == 2
    bars = axes.containers[0]
    line = bars.lines[0].get_xydata()
    for (x, y), low, high in zip(line, (0.85, 0.87), (0.87, 0.9), strict=True):
        part = states[(states["rho"] >= low) & (states["rho"] < high)]
        packings = part.groupby(["n", "seed"])["pressure"].mean().to_numpy()
        assert (x, y) == pytest.approx((part["rho"].mean(), packings.mean()))
        (bar,) = (b for b in bars.lines[2][0].get_segments() if b[0, 0] == pytest.approx(x))
        assert len(packings) == 2  # drawn as wholes: two thirds of the means lie between one and the other
        wide = stdtrit(1, 0.8413447) * np.sqrt(2)  # intervals of two packings shall hold as often as others
        assert 0.5 * np.ptp(bar[:, 1]) == pytest.approx(wide * 0.5 * np.ptp(packings), rel=1e-3)
    assert axes.get_ylabel() == "pressure $p$  [ε/σ²]" and axes.get_xlabel() == r"true packing fraction $\rho$"
    assert entries == ["soft particles (SP), n = 8", "soft particles (SP), n = 10"]


def test_a_mean_of_a_selection_is_hollow_and_said():
    """At onset most packings have no G: the mean is that of the few that are stable."""
    rho, seeds = np.tile([0.84, 0.9], 12), np.repeat(np.arange(12), 2)
    g = np.where((rho > 0.85) | (seeds < 2), 0.1 + rho, np.nan)
    frame = pd.DataFrame({"model": "sp", "n": 8, "seed": seeds, "units": "eps", "rho": rho, "g": g})
    axes = Figure().subplots()
    draw_means(axes, frame, "g", "rho", "model", None)
    hollow, sample = (line for line in axes.lines if line.get_markerfacecolor() == "white")
    assert hollow.get_xydata().ravel() == pytest.approx([0.84, 0.94]) and not len(sample.get_xydata())
    assert len(axes.get_legend().get_texts()) == 2


def test_bins_hold_every_value():
    for values in (np.linspace(0.3, 0.9, 50), np.geomspace(1e-5, 1, 50), np.array([1.0, 2.0, np.nan])):
        edges, logarithmic = choose_bins(values)
        finite = values[np.isfinite(values)]
        assert np.all((finite >= edges[0]) & (finite < edges[-1])) and np.all(np.diff(edges) > 0)
        assert logarithmic == (np.ptp(np.log(finite)) > np.log(30))


def test_what_cannot_be_plotted_is_refused(full):
    for args in (("zz",), ("z", "zz"), ("task",), ("contact_length", "target_pressure")):
        with pytest.raises(jamlab.InputError) as caught:
            plotted(full, *args, sweep="up")
        assert args[-1] in str(caught.value)
    for wrong in ({"ax": "axes"}, {"colour": "red"}, {"bins": [2, 1]}):
        with pytest.raises(jamlab.InputError):
            full.plot("z", **wrong)
