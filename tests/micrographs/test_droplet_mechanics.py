"""Pressures and forces by shape: analytic outlines, rendered droplets with known forces, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from commands import call
from PIL import Image
from rendered_pictures import forces_seen

import jamlab
from jamlab.errors import InputError
from jamlab.micrographs.droplet_mechanics import STEEPER, shape_forces

pytest.importorskip("skimage")


PIXELS = 320


def stadium(radius, flat, count=4000):
    """(k, 2) outline of two half circles and two flats, evenly spaced, and its points on the right flat."""
    edge, half = 2 * flat + 2 * np.pi * radius, np.pi * radius
    s = (np.arange(count) + 0.5) * edge / count
    x, y = np.empty(count), np.empty(count)
    right, left = s < flat, (s >= flat + half) & (s < 2 * flat + half)
    top, bottom = (s >= flat) & (s < flat + half), s >= 2 * flat + half
    x[right], y[right] = radius, s[right] - flat / 2
    x[left], y[left] = -radius, flat / 2 - (s[left] - flat - half)
    turn = (s[top] - flat) / radius
    x[top], y[top] = radius * np.cos(turn), flat / 2 + radius * np.sin(turn)
    turn = np.pi + (s[bottom] - 2 * flat - half) / radius
    x[bottom], y[bottom] = radius * np.cos(turn), -flat / 2 + radius * np.sin(turn)
    return np.column_stack([x, y]), np.where(right, 1, np.where(left, 2, -1))


def test_flat_between_walls_has_pressure_and_force_of_laplace():
    ring, beside = stadium(30.0, 20.0)
    pressures, forces = shape_forces([ring], [beside], np.zeros((1, 2)), gap=0.0)
    assert pressures.value[0] == pytest.approx(1 / 30, rel=1e-3)
    np.testing.assert_allclose(forces.size * STEEPER, 20 / 30, rtol=0.01)
    np.testing.assert_allclose(np.abs(forces.direction), [[1, 0], [1, 0]], atol=1e-3)
    assert forces.residual[0] < 1e-3 and (forces.pairs == [[0, -1], [0, -1]]).all()


def test_a_force_lacks_a_fringe_at_either_end_of_its_flat():
    """Walls that part are nearer than g over sqrt(g/kappa) beside each end, which adds kappa times as much."""
    ring, beside = stadium(30.0, 20.0)
    plain, less = (shape_forces([ring], [beside], np.zeros((1, 2)), gap=gap)[1].size for gap in (0.0, 0.3))
    np.testing.assert_allclose((plain - less) * STEEPER, 2 * np.sqrt(0.3 / 30), rtol=1e-3)


def test_free_circle_has_pressure_and_no_force_and_scales():
    ring, beside = stadium(30.0, 1e-9)
    nothing = np.full_like(beside, -1)
    for scale in (1.0, 3.0):
        pressures, forces = shape_forces([scale * ring], [nothing], np.zeros((1, 2)), gap=1.0)
        assert pressures.value[0] * scale == pytest.approx(1 / 30, rel=1e-6) and len(forces.size) == 0


def test_hidden_wall_has_no_pressure():
    ring, beside = stadium(30.0, 20.0)
    pressures, forces = shape_forces([ring], [np.where(beside < 0, 3, beside)], np.zeros((1, 2)), gap=0.0)
    assert np.isnan(pressures.value[0]) and len(forces.size) == 0 and np.isnan(forces.residual[0])


@pytest.fixture(scope="module")
def seen(dp_dense):
    """A rendered picture, and what is found in it."""
    picture = jamlab.synthetic_micrograph(dp_dense, PIXELS)
    return picture, jamlab.micrograph(picture, dp_dense.box[0, 0] / PIXELS, periodic=True, contrast="bright")


def test_forces_of_rendered_droplets_are_those_of_the_packing(dp_dense, seen):
    found = seen[1]
    expected, size, error = forces_seen(dp_dense, found)
    assert np.corrcoef(expected, size)[0, 1] > 0.8
    assert (np.abs(size - expected) < 2 * error).mean() > 0.8
    assert np.nanmedian(found.forces.residual) < 0.2


def test_small_droplets_small_voids_and_labels_are_refused(dp_dense, seen):
    small = jamlab.micrograph(jamlab.synthetic_micrograph(dp_dense, 120, film=1.0), periodic=True, contrast="bright")
    with pytest.raises(InputError):
        _ = small.forces
    with pytest.raises(InputError):
        _ = replace(seen[1], rho=0.97).pressures
    y, x = np.mgrid[:100, :100]
    with pytest.raises(InputError):
        _ = jamlab.micrograph(labels=(np.hypot(x % 50 - 25, y % 50 - 25) < 20).astype(int)).pressures


def test_command_prints_the_balance_and_keeps_a_packing(dp_dense, seen, tmp_path):
    picture, found = seen
    Image.fromarray((255 * picture.clip(0, 1)).astype(np.uint8)).save(tmp_path / "photo.png")
    how = ("analyze", "photo.png", "--contrast", "bright", "--periodic")
    done = call(tmp_path, *how, "--packing", "disks.h5", "--model", "sp")
    assert done.exit_code == 0, done.stderr
    residual = np.median(found.forces.residual)
    shown = float(done.stdout.split("forces by shape leave ")[1].split("%")[0])
    assert shown == pytest.approx(100 * residual, abs=2)
    kept = jamlab.read(tmp_path / "disks.h5")
    assert (kept.model, kept.n) == ("sp", dp_dense.n)
    Image.fromarray((255 * picture[::4, ::4].clip(0, 1)).astype(np.uint8)).save(tmp_path / "photo.png")
    assert "forces need 30 or more" in call(tmp_path, *how).stdout
