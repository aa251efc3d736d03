"""Shear until an unjammed packing jams: the bracket, its strain by other steps, and packings that never jam."""

import numpy as np
import plain_cycles
import pytest

import jamlab
from jamlab import quasistatic_shear
from jamlab.flow.run import FileSteps
from jamlab.packing.deformation import at_phi


@pytest.fixture(scope="module")
def loose():
    return jamlab.pack(n=12, phi=0.84, seed=2)


@pytest.fixture(scope="module")
def run(loose):
    return quasistatic_shear(loose, 0.1, 0.02, until_jammed=True)


def test_it_stops_at_the_first_state_that_bears_pressure(run):
    """Contacts by plain numpy: rattlers alone in the state before, a rigid backbone in the last one."""
    found = run.jamming
    assert run.state == "jammed" and run.finished and run.packing is found.packing
    assert 0 < found.strain - found.strain_below <= 2e-5 and found.strain == run.strain[-1] < 0.1
    assert found.pressure > 1e-10 and (run.pressure[:-1] < 1e-11).all() and run.converged.all()
    loose = plain_cycles.rattlers(found.packing)
    i, j, _ = plain_cycles.disk_contacts(found.packing)
    bearing = ~(loose[i] | loose[j])
    assert bearing.sum() >= 2 * (~loose).sum() - 1  # isostatic, with one state of self-stress
    assert "jams above" in repr(run) and run.balanced


def test_the_state_before_bears_no_pressure(loose, run):
    """Along the same strains, and not below them; beyond, pressure grows."""
    before = quasistatic_shear(loose, run.strain[1:-1], 0.02)
    assert before.strain[-1] == run.jamming.strain_below
    energy, _ = plain_cycles.disk_energy_and_stress(before.packing)
    assert energy < 1e-22 and abs(before.pressure).max() < 1e-11  # what the force tolerance leaves
    on = quasistatic_shear(run.packing, 2e-4, 1e-4)
    assert run.jamming.pressure < on.pressure[1] < on.pressure[2]


@pytest.mark.slow
def test_the_strain_of_jamming_does_not_depend_on_the_step(loose, run):
    fine = quasistatic_shear(loose, 0.1, 0.005, until_jammed=True)
    assert fine.jamming.strain == pytest.approx(run.jamming.strain, abs=2e-3)


def test_a_packing_that_never_jams_says_so():
    run = quasistatic_shear(jamlab.pack(8, phi=0.5, seed=1), [0.1, -0.1], 0.05, until_jammed=True)
    assert run.state == "never jammed" and run.jamming is None and "NEVER JAMMED" in repr(run)
    assert run.strain[-1] == -0.1 and run.finished


def test_it_goes_on_from_its_file(loose, run, tmp_path):
    file = tmp_path / "run.h5"

    def stop(share, words):
        if share > 0.15:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("jamlab.flow.run.RECORD", FileSteps(every=0.0))
        quasistatic_shear(loose, 0.1, 0.02, until_jammed=True, path=file, progress=stop)
    assert jamlab.read_flow(file).state == "interrupted"
    found = quasistatic_shear(loose, 0.1, 0.02, until_jammed=True, path=file)
    assert found.jamming.strain == pytest.approx(run.jamming.strain, abs=1e-9)
    assert jamlab.read_flow(file).jamming.strain == found.jamming.strain
    assert quasistatic_shear(loose, 0.1, 0.02, until_jammed=True, path=file).steps == found.steps


def test_sticky_disks_are_refused():
    sticky = jamlab.pack(8, phi=0.5, seed=1, law={"stickiness": 0.05})
    with pytest.raises(jamlab.InputError, match=r"until_jammed = True: particles that attract.*repulsive"):
        quasistatic_shear(sticky, 0.1, 0.05, until_jammed=True)


def test_droplets_jam_too():
    jammed = jamlab.jam(6, "dp", seed=3)
    loose = jamlab.relax(at_phi(jammed, 0.985 * jammed.phi))
    run = quasistatic_shear(loose, 0.2, 0.05, until_jammed=True)
    assert run.state in ("jammed", "never jammed") and np.isfinite(run.pressure).all()
