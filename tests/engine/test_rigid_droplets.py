"""Droplets as rigid bodies: energy and derivatives against plain loops, differences and LAMMPS, and relaxations."""

from dataclasses import astuple, replace

import numpy as np
import pytest
import reference

import jamlab
from jamlab.engine.rigid_droplets import RigidDroplets
from jamlab.packing.deformation import at_phi
from jamlab.protocols.preconditioned_lbfgs import FAR
from jamlab.protocols.random_start import droplet_cell, droplet_params, free_diameters, place_droplets, random_disks

DESCENT = (1e-9, 1e-13, 1e-22, *astuple(replace(FAR, least_shift=1e-10)), 1e-3, 4.0)
LEANING = np.array([[3.4, 0.0], [0.9, 3.1]])


def overlapping(vertices=None, phi=0.75):
    """Nine droplets near a square lattice in a leaning box, pressed together and turned at random; rows of three touch
    their own images."""
    nv, params = droplet_params(9, vertices=vertices)
    rng = np.random.default_rng(3)
    centres = (np.stack(np.meshgrid(*2 * [np.arange(3)]), -1).reshape(-1, 2) + 0.04 * rng.normal(size=(9, 2))) / 3
    return RigidDroplets.of(at_phi(place_droplets(centres @ LEANING, LEANING, nv, params, 1), phi))


def pressed(**how):
    """The same, relaxed at a packing fraction above onset."""
    state = overlapping()
    for phi in np.arange(0.75, 1.0, 0.01):
        state = state.relaxed(DESCENT, 2000, phi=phi, saddles=20, **how)
        if state.energy > 1e-3:
            break
    return state


def moved(state, step):
    """As the kernel moves coordinates: box and centres sheared, then displaced."""
    n = len(state.coordinates)
    stretch, shear = step[3 * n : 3 * n + 2] / np.sqrt(n)
    gradient = np.array([[np.exp(stretch), shear], [0, np.exp(-stretch)]])
    coordinates = state.coordinates.copy()
    coordinates[:, :2] = coordinates[:, :2] @ gradient.T
    box = state.droplets.box @ gradient.T
    return replace(
        state,
        coordinates=coordinates + step[: 3 * n].reshape(n, 3),
        droplets=state.droplets.with_state(box=box, positions=state.droplets.positions @ gradient.T),
    )


@pytest.mark.parametrize("vertices", [None, 5, 24])
def test_energy_is_that_of_lammps_and_of_plain_loops(vertices):
    state = overlapping(vertices)
    energy = state.derivatives()[0]
    assert energy > 1e-3
    assert energy == pytest.approx(reference.evaluate(state.packing()).contact_energy, rel=1e-12)
    assert energy == pytest.approx(jamlab.evaluate(state.packing()).contact_energy, rel=1e-12)


def test_forces_and_hessian_are_derivatives_with_those_of_the_box():
    state = overlapping()
    _, forces, hessian = state.derivatives(shears=True)
    steps = 2e-5 * np.eye(len(forces))
    energies = np.array([[moved(state, s).derivatives()[0], moved(state, -s).derivatives()[0]] for s in steps])
    assert forces == pytest.approx(-(energies[:, 0] - energies[:, 1]) / 4e-5, abs=1e-7)
    m = len(forces) - 3
    slopes = [(moved(state, s).derivatives()[1] - moved(state, -s).derivatives()[1]) / -4e-5 for s in steps[:m]]
    assert hessian[:m, :m] == pytest.approx(np.array(slopes), abs=2e-5)
    assert hessian == pytest.approx(hessian.T, abs=1e-12)
    for a, b in ((m, m), (m, m + 1), (m + 1, m + 1), (m, 0), (m + 1, 2), (m, 5)):  # of the box: from energies
        s, t = 5 * steps[a], 5 * steps[b]
        four = [moved(state, x).derivatives()[0] for x in (s + t, s - t, t - s, -s - t)]
        assert (four[0] - four[1] - four[2] + four[3]) / 4e-8 == pytest.approx(hessian[a, b], abs=1e-3)


def test_energy_and_forces_are_the_same_for_images_turns_and_translations():
    state = overlapping(12)
    energy, forces, _ = state.derivatives()
    coordinates = state.coordinates.copy()
    coordinates[:, :2] += np.outer(np.arange(9) - 4, state.droplets.box[1] - 2 * state.droplets.box[0])
    coordinates[:, :2] += [17.3, -4.1]
    radii = np.hypot(*(state.packing().positions[::12] - state.coordinates[:, :2]).T)
    coordinates[:, 2] += 5 * radii * 2 * np.pi / 12  # a regular polygon onto itself
    turned = replace(state, coordinates=coordinates)
    assert turned.derivatives()[0] == pytest.approx(energy, rel=1e-9)
    assert turned.derivatives()[1] == pytest.approx(forces, abs=1e-9)


@pytest.mark.parametrize("shears", [False, True])
def test_a_relaxation_ends_in_a_minimum_and_keeps_the_area(shears):
    found = pressed(shears=shears)
    assert not found.relaxed(DESCENT, 500, shears=shears).crossed
    energy, forces, hessian = found.derivatives(shears=shears)
    assert energy == pytest.approx(found.energy) and energy > 1e-3
    assert np.abs(forces).max() <= 1e-9 * found.contact_force
    assert np.linalg.eigvalsh(hessian).min() > -1e-3 * found.contact_force
    box = found.droplets.box * np.sqrt(found.phi / 0.75)
    assert np.linalg.det(box) == pytest.approx(np.linalg.det(overlapping().droplets.box), rel=1e-12)
    assert np.allclose(box, overlapping().droplets.box, rtol=1e-9) != shears


def test_what_is_loose_comes_apart_and_what_is_followed_keeps_its_contacts():
    jammed = pressed()
    near = jammed.relaxed(DESCENT, 500, phi=jammed.phi - 1e-4)
    assert near.energy < jammed.energy
    loose = jammed.relaxed(DESCENT, 2000, phi=0.6)
    assert loose.energy <= DESCENT[2] and loose.phi == pytest.approx(0.6)


def test_droplets_that_travel_far_find_new_neighbours():
    """A row pressed together spreads, until its ends, out of reach of each other before, meet across the box."""
    nv, params = droplet_params(12, vertices=24)
    lone = place_droplets(np.zeros((12, 2)), np.array([[36.0, 0.0], [0.0, 4.0]]), nv, params, 1)
    free = np.hypot(*lone.positions.T).reshape(12, 24).max(axis=1) + params["delta"] / 2
    apart = free + np.roll(free, -1)
    places = np.append(0.0, np.cumsum(0.93 * apart[:-1]))
    box = np.array([[places[-1] + apart[-1] + 0.6, 0.0], [0.0, 4.0]])
    row = RigidDroplets.of(place_droplets(np.column_stack([places, np.full(12, 2.0)]), box, nv, params, 1))
    spread = row.relaxed(DESCENT, 2000)
    assert np.abs(spread.coordinates - row.coordinates)[:, 0].max() > 0.3
    assert spread.energy == pytest.approx(spread.derivatives()[0], rel=1e-9, abs=1e-15)


def test_crossed_outlines_are_refused():
    state = overlapping()
    state.coordinates[1, :2] = state.coordinates[0, :2] + [0.2, 0.1]
    assert state.relaxed(DESCENT, 100).crossed
    with pytest.raises(jamlab.EngineError):
        state.derivatives()


def test_droplets_pressed_together_come_apart_in_few_steps():
    """With gaps in the Hessian that steps will close, they are at most 60."""
    nv, params = droplet_params(36)
    disks = random_disks(36, 1, phi=0.65, large=0.5, sizes=None)
    scale = droplet_cell(nv, params, 0.65) / disks.box[0, 0]
    held = jamlab.relax(
        disks.with_state(box=disks.box * scale, positions=disks.positions * scale, diameters=free_diameters(nv, params))
    )
    placed = place_droplets(held.positions, held.box, nv, params, 1)
    pressed_together = RigidDroplets.of(at_phi(placed, 0.78))
    assert pressed_together.derivatives()[0] > 1.0
    assert pressed_together.relaxed(DESCENT, 60).energy <= DESCENT[2]
