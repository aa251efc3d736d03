"""
Kinks of the contact energy
===========================

One polygon lies flat on another and is rotated. In form ``segment``, the published eq 8, the torque jumps where edges
are parallel; in the other two forms it is continuous. See :doc:`/explanation/contact_forms`.
"""

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import jamlab
from jamlab.mechanics.stiffness import energy_terms, forces
from jamlab.plotting import in_unit, label_axes

# %%
# Two bricks of twelve vertices at a distance of 0.15; rims are 0.25 wide.

x, y = np.linspace(-0.8, 0.8, 5), np.linspace(-0.4, 0.4, 3)
brick = np.concatenate(
    [
        np.column_stack([x[:-1], np.full(4, -0.4)]),
        np.column_stack([np.full(2, 0.8), y[:-1]]),
        np.column_stack([x[:0:-1], np.full(4, 0.4)]),
        np.column_stack([np.full(2, -0.8), y[:0:-1]]),
    ]
)
centres = np.array([[3.0, 3.0], [3.1, 3.95]])
angles = np.linspace(-0.12, 0.12, 241)


def turned(angle: float) -> NDArray[np.float64]:
    """Positions of both bricks, the upper one turned."""
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.vstack([brick + centres[0], brick @ turn + centres[1]])


figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
for form, color in zip(("segment", "outline", "segment/smooth"), ("#D55E00", "#0072B2", "#009E73"), strict=True):
    law = {"gamma": 0.0, "ka": 1e-9, "eps": 1.0, "delta": 0.25, "eta": 0.0, "contact": form, "a0": [1.28, 1.28]}
    bricks = jamlab.Packing("dp", [[8.0, 0.0], [0.0, 8.0]], turned(0.0), law, offsets=[0, 12, 24])
    energy, torque = [], []
    for angle in angles:
        state = bricks.with_state(positions=turned(angle))
        r, f = (state.positions - centres[1])[12:], forces(state)[12:]
        energy.append(sum(term.energy.sum() for term in energy_terms(state)))
        torque.append(np.sum(r[:, 0] * f[:, 1] - r[:, 1] * f[:, 0]))
    axes[0].plot(angles, energy, color=color, label=form)
    axes[1].plot(angles, torque, color=color, label=form)
    print(f"{form:15s} largest jump of the torque in one step: {np.abs(np.diff(torque)).max():.3f}")
for ax, quantity in zip(axes, ("energy", "torque"), strict=True):
    label_axes(ax, in_unit("angle between the flats", "rad"), in_unit(quantity, "ε"))
axes[0].legend()
