"""Outlines that touch themselves, for keyword `self` of pair style circuloline."""

import numpy as np
import outlines

NEAR = 0.1


def horseshoe(n=9, opening=0.14):
    """Two tips that nearly meet."""
    turn = np.linspace(opening, 2 * np.pi - opening, n)
    arm = np.column_stack([np.cos(turn), np.sin(turn)])
    return np.concatenate([0.95 * arm, 0.5 * arm[::-1]])


def dumbbell(n=17):
    """A neck narrower than rims are wide."""
    turn = 2 * np.pi * np.arange(n) / n
    return np.column_stack([0.9 * np.cos(turn), np.sin(turn) * (0.09 + 0.3 * np.cos(turn) ** 2)])


def spiked(n=11):
    """One vertex far out, its neighbours close to each other."""
    points = outlines.regular(n, (0, 0), 0.6).points
    points[:3] = [[0.55, -0.02], [1.1, 0.0], [0.55, 0.03]]
    return points


def folded(seed=1, near=NEAR):
    """Outlines that touch themselves, each other and images of each other; some leave the box."""
    rng = np.random.default_rng(seed)
    found = []
    for k, points in enumerate((horseshoe(), dumbbell(), spiked())):
        angle = rng.uniform(0, 2 * np.pi)
        turned = points @ [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        turned += np.array([2.0 * k, 0.0]) + rng.uniform(-0.01, 0.01, points.shape)
        found.append(outlines.Outline(turned, a0=outlines.Outline(turned).area * 1.1))
    return outlines.Scene(found, np.array([6.0, 2.15]), near)
