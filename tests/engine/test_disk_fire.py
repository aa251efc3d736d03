"""FIRE over disks in compiled code: LAMMPS' own steps, on any number of threads, and the box as coordinates."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.engine.disk_fire import FIRE, fire_disks, fire_numbers
from jamlab.errors import EngineError
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.box_strains import COMPRESSION, SHEARS, BoxStrains
from jamlab.protocols.random_start import random_disks as disks_of

ALL = np.concatenate([COMPRESSION, SHEARS])


def by_lammps(packing, steps):
    """Positions after steps of `min_style fire` itself."""
    with jamlab.Session(packing) as session:
        session.use_minimizer("fire")
        session.command(f"minimize 0.0 1e-13 {steps} {10 * steps}")
        return session.positions()


def plain_fire(packing, steps, box_strains, fire):
    """The method in numpy, strains of the box among the coordinates; yields every state."""
    size = packing.diameters.mean()
    light = np.minimum(1, 2 * size / packing.diameters)[:, None]  # 1/mass
    inertia = np.sqrt(packing.n) * size
    v, w = np.zeros_like(packing.positions), np.zeros(len(box_strains.strains))
    first, tmax, dmax, tmin, grow, shrink, alpha0, alphashrink = fire
    dt, alpha, last_negative = first, alpha0, 0

    def push(p):
        return forces(p), -box_strains.gradient(stress(p), p.area) / inertia

    for step in range(1, steps + 1):
        f, g = push(packing)
        keep, steer, start = 1.0, 0.0, step == 1
        power = np.vdot(v, f) + w @ g
        if power > 0:
            keep = 1 - alpha
            steer = alpha * np.sqrt((np.vdot(v, v / light) + w @ w) / (np.vdot(f, light * f) + g @ g))
            if step - last_negative > FIRE.delay:
                dt, alpha = min(dt * grow, tmax * first), alpha * alphashrink
        else:
            last_negative, start = step, True
            if step >= FIRE.delay:
                dt, alpha = max(dt * shrink, tmin * first), alpha0
            packing = box_strains.move(packing, -0.5 * dt * v, -0.5 * dt * w / inertia)
            v, w = 0 * v, 0 * w
            f, g = push(packing)
        fast = max(np.abs(v + start * dt * light * f).max(), 10 * np.abs(w + start * dt * g).max() / inertia)
        step_time = min(dt, dmax / fast)
        v, w = keep * (v + step_time * light * f) + steer * light * f, keep * (w + step_time * g) + steer * g
        packing = box_strains.move(packing, step_time * v, step_time * w / inertia)
        yield packing, power


@pytest.mark.parametrize("units, tilt", [("eps", 0.0), ("k", 0.45)])
def test_steps_are_those_of_lammps(random_disks, units, tilt):
    """To rounding, which grows tenfold in 20 steps; 150 steps hold many half steps back and new neighbor lists."""
    start = random_disks(tilt, units, seed=2, n=200)
    for steps, digits in ((1, 1e-13), (30, 1e-11), (150, 1e-7)):
        moved, taken, _ = fire_disks(start, 1e-13, steps)
        assert taken == steps
        assert np.abs(moved.positions - by_lammps(start, steps)).max() < digits
    assert np.abs(moved.positions - start.positions).max() > 0.3  # neighbors have changed


@pytest.mark.parametrize("threads", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_threads_do_not_change_a_digit(threads):
    """Three shares of disks, whose pairs across are computed twice: one thread, several threads and LAMMPS."""
    start = disks_of(12_500, 1, phi=0.9, units="k")
    box_strains = BoxStrains(ALL, 0.01)
    alone, shared = (fire_disks(start, 1e-13, 300, k, box_strains) for k in (1, threads))
    assert np.array_equal(alone[0].positions, shared[0].positions) and np.array_equal(alone[0].box, shared[0].box)
    assert alone[1:] == shared[1:]
    moved, _, _ = fire_disks(start, 1e-13, 30, threads)
    assert np.abs(moved.positions - by_lammps(start, 30)).max() < 1e-10


@pytest.mark.parametrize(
    "strains, lively, heavy",
    [
        pytest.param(COMPRESSION, True, False, id="size-lively"),
        pytest.param(COMPRESSION, False, False, id="size"),
        pytest.param(SHEARS, False, False, id="shears"),
        pytest.param(ALL, False, False, id="both"),
        pytest.param(ALL, True, True, id="heavy"),
    ],
)
def test_strains_of_the_box_are_coordinates(random_disks, strains, lively, heavy):
    """Beside FIRE in numpy, box and positions, uphill and downhill."""
    start, fire = random_disks(0.2, "k", seed=1, n=60), fire_numbers(lively=lively)
    if heavy:
        start = disks_of(150, 1, phi=1.0, units="k", sizes="power-law:-2,1,8")
        assert start.diameters.max() > 3
    box_strains = BoxStrains(strains, 0.05)
    powers = []
    for steps, (plain, power) in enumerate(plain_fire(start, 60, box_strains, fire), 1):
        powers.append(power)
        if steps in (1, 60):
            moved, _, _ = fire_disks(start, 1e-13, steps, 1, box_strains, fire)
            assert np.allclose(moved.positions, plain.positions, rtol=0, atol=1e-9)
            assert np.allclose(moved.box, plain.box, rtol=0, atol=1e-10)
    assert min(powers[1:]) < 0 < max(powers)
    assert np.abs(moved.box - start.box).max() > 1e-3


def test_force_and_stress_are_met(random_disks):
    """As LAMMPS finds them: the largest force left is the one reported, the pressure the one asked for."""
    box_strains = BoxStrains(ALL, 1e-2)
    moved, taken, largest = fire_disks(random_disks(0.0, "k", n=100), 1e-10, 50_000, 1, box_strains)
    state = jamlab.evaluate(moved)
    assert taken < 50_000 and largest < 1e-10
    assert max(state.max_force, box_strains.excess(state.stress) * moved.diameters.mean()) == pytest.approx(
        largest, rel=1e-3
    )
    assert state.pressure == pytest.approx(1e-2, rel=1e-8)


def test_shear_stress_alone_keeps_it_from_ending():
    """A sheared crystal, whose forces balance: what is left is the stress of a shear over its norm."""
    i, j = np.divmod(np.arange(64), 8)
    for turn in (np.array([[1.02, 0.0], [0.0, 0.98]]), np.array([[1.0, 0.03], [0.0, 1.0]])):
        box = turn @ (8 * 0.95 * np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]]))
        places = np.column_stack([j, i]) / 8 @ box.T
        crystal = jamlab.Packing("sp", box.T, places, {"k": 1.0}, diameters=np.ones(64), units="k")
        box_strains = BoxStrains(SHEARS)
        moved, _, largest = fire_disks(crystal, 1e-14, 1, 1, box_strains)
        state = jamlab.evaluate(moved)
        assert state.max_force < 1e-12 and largest == pytest.approx(box_strains.excess(state.stress), rel=1e-9)


@pytest.mark.parametrize("style, model", [("cg", "sp"), ("fire", "dp"), ("cg", "dp")])
def test_strains_that_no_style_takes_are_refused(sp_jammed, dp_onset, style, model):
    with jamlab.Session(sp_jammed if model == "sp" else dp_onset) as session:
        for name, value in (("box_strains", BoxStrains(SHEARS)), ("fire", fire_numbers())):
            with pytest.raises(jamlab.InputError, match=name):
                session.minimize(1e-9, minimizer=style, steps=10, **{name: value})


def test_lammps_descends_where_a_box_is_too_small_for_the_kernel(random_disks):
    with jamlab.Session(random_disks(n=8)) as session:
        assert session.minimize(1e-9, minimizer="fire", steps=20_000, stretch=3000).max_force < 1.1e-9
        assert fire_disks(session.packing(), 1e-9, 10) is None


def test_positions_that_no_box_holds_are_refused(random_disks):
    """Farther away than numbers can tell from their images."""
    start = random_disks(n=100)
    far = start.positions + np.array([1e12, 0.0])
    object.__setattr__(start, "positions", far)
    with pytest.raises(EngineError):
        fire_disks(start, 1e-9, 10)


TEAM = r"""
#include "kernels/thread_team.h"
#include <cstdlib>
#include <new>
static int left = 1 << 30;    // allocations
void *operator new(std::size_t size)
{
  if (--left < 0) throw std::bad_alloc();
  return std::malloc(size);
}
void operator delete(void *p) noexcept { std::free(p); }
void operator delete(void *p, std::size_t) noexcept { std::free(p); }
int main()
{
  for (int most = 0; most < 8; most++) {
    ThreadTeam team(4);
    std::atomic<int> ran{0};
    left = most;
    const bool started = team.run([&](int) { ran++; });
    left = 1 << 30;
    if (ran != (started ? 4 : 0) || started != (most >= 4)) return 1 + most;
  }
  return 0;
}
"""


@pytest.mark.slow
def test_threads_that_lack_memory_end(tmp_path):
    """Where the n-th allocation fails: none works, those that wait are joined, and nothing terminates."""
    if not (compiler := shutil.which("c++")):
        pytest.skip("no C++ compiler")
    (tmp_path / "team.cpp").write_text(TEAM)
    plugin = Path(__file__).parents[2] / "plugin"
    line = [compiler, "-std=c++17", f"-I{plugin}", "-pthread", "team.cpp", "-o", "team"]
    subprocess.run(line, cwd=tmp_path, check=True, timeout=300)
    assert subprocess.run([tmp_path / "team"], timeout=60).returncode == 0


@pytest.mark.parametrize("ranks", [0, -2, True, 1.5, "2", None])
def test_bad_numbers_of_threads_are_refused_before_anything_runs(ranks):
    with pytest.raises(jamlab.InputError) as caught:
        jamlab.pack(8, 1e-2, ranks=ranks)
    assert repr(ranks) in str(caught.value)


def test_droplets_take_one_rank(random_polygons):
    with pytest.raises(jamlab.InputError):
        jamlab.Session(random_polygons(), ranks=2)
