"""Laws of outlines: bending stiffness, elastic perimeters and edges."""

import re

import numpy as np
import plain_outline_laws as plain
import pytest
from engine.test_plugin_on_ranks import launch
from invariant_cases import VIEWS, View
from scipy.optimize import brentq, minimize_scalar

import jamlab
from jamlab.installed_files import installed
from jamlab.models.droplets import free_area, free_polygon_area, regular_polygon
from jamlab.outline_laws.bending import BendingLaw
from jamlab.outline_laws.outline_law import OUTLINE_LAWS
from jamlab.protocols.rest_areas import rest_areas_of

LAWS = {
    "straight": {"kappa": 0.3, "theta0": 0.0},
    "round": {"kappa": 0.2},
    "perimeter": {"kp": 2.0, "p0": 3.7},
    "edges": {"kl": 0.7, "p0": 3.9},
    "all": {"kappa": 0.05, "theta0": 0.6, "kp": 1.3, "kl": 0.4, "p0": 3.8},
}


def state(seed, law, box=20.0, lean=0.0):
    """Three droplets in contact, none of them regular; one lies across the edge of the box."""
    rng = np.random.default_rng(seed)
    rings = []
    for m, nv in enumerate((9, 12, 7)):
        ring = regular_polygon(nv, 1.0, rng.random()) * (1 + 0.12 * rng.random((nv, 1)))
        rings.append(ring + np.array([0.2 + 1.35 * m, 0.3 * rng.random()]))
    params = {"gamma": 0.2, "ka": 30.0, "eps": 1.3, "delta": 0.3, "eta": 0.0, "contact": "outline"}
    params |= {"a0": np.array([1.0, 1.1, 0.9])} | law
    offsets = np.cumsum([0, *map(len, rings)])
    return jamlab.Packing("dp", np.array([[box, 0.0], [lean, box]]), np.concatenate(rings), params, offsets=offsets)


def own(packing):
    """Terms of the laws of outlines: energy, gradient, Hessian."""
    terms = [each for each in packing.kind.shape_terms(packing) if each.name in ("bending", "perimeter")]
    size, gradient = len(packing.positions), np.zeros(packing.positions.shape)
    for each in terms:
        np.add.at(gradient, each.sites, each.gradient)
    matrix = np.zeros((size, 2, size, 2))
    for each in terms:
        for sites, block in zip(each.sites, each.hessian, strict=True):
            matrix[np.ix_(sites, [0, 1], sites, [0, 1])] += block
    return sum(each.energy.sum() for each in terms), gradient, matrix


def close(found, wanted, error):
    np.testing.assert_allclose(found, wanted, rtol=0, atol=error * np.abs(wanted).max())


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("seed", [1, 2])
def test_ten_states_by_plain_loops_and_by_lammps(name, seed):
    p = state(seed, LAWS[name], lean=3.0 * (seed - 1))
    energy, gradient, matrix = own(p)
    assert energy == pytest.approx(plain.energy(p, p.positions), rel=1e-12)
    close(gradient, plain.gradient(p, p.positions), 1e-10)

    found, all_of = jamlab.evaluate(p), p.kind.terms(p, True)
    slope, work = np.zeros(p.positions.shape), np.zeros((2, 2))
    for each in all_of:
        np.add.at(slope, each.sites, each.gradient)
        work -= np.einsum("kma,kmb->ab", each.gradient, each.local)
    assert found.energy == pytest.approx(sum(each.energy.sum() for each in all_of), rel=1e-12)
    close(found.forces, -slope, 1e-10)
    close(found.stress, work / p.area, 1e-10)
    plain_law = p.with_state(params={k: v for k, v in p.params.items() if k not in LAWS[name]})
    close(found.forces - jamlab.evaluate(plain_law).forces, -plain.gradient(p, p.positions), 1e-10)

    rng, h = np.random.default_rng(seed), 1e-4  # Hessian: differences, of fourth order, of gradients by complex steps
    way = rng.normal(size=p.positions.shape)
    steps = [plain.gradient(p, p.positions + k * h * way) for k in (-2, -1, 1, 2)]
    product = (8 * (steps[2] - steps[1]) - (steps[3] - steps[0])) / (12 * h)
    close(np.einsum("iajb,jb->ia", matrix, way), product, 1e-9)
    close(matrix, matrix.transpose(2, 3, 0, 1), 1e-13)


def test_a_strength_of_zero_changes_no_bit():
    one = jamlab.jam(4, "dp", seed=1)
    other = jamlab.jam(4, "dp", seed=1, law={"kappa": 0.0, "kp": 0.0, "kl": 0.0})
    assert np.array_equal(one.positions, other.positions) and np.array_equal(one.box, other.box)


def alone(nv, law, area=np.pi):
    """One regular polygon."""
    params = {"gamma": 0.0, "ka": 1.0, "eps": 1.0, "delta": 0.1, "eta": 0.0, "contact": "outline"}
    params |= {"a0": np.array([area])} | law
    return jamlab.Packing("dp", np.diag([20.0, 20.0]), regular_polygon(nv, area), params, offsets=[0, nv])


@pytest.mark.parametrize("nv", [12, 24, 96])
def test_bending_of_a_ring_goes_to_that_of_a_circle(nv):
    p = alone(nv, {"kappa": 0.7, "theta0": 0.0})
    radius = float(np.hypot(*p.positions[0]))
    energy = sum(each.energy.sum() for each in p.kind.shape_terms(p) if each.name == "bending")
    # pi kappa/R of a circle; the polygon has edges of 2 R sin(pi/nv)
    assert energy == pytest.approx(np.pi * 0.7 / radius * (np.pi / nv) / np.sin(np.pi / nv), rel=1e-12)
    round_ = p.with_state(params={**p.params, "theta0": 1.0})
    assert abs(sum(each.energy.sum() for each in round_.kind.shape_terms(round_) if each.name == "bending")) < 1e-20


def elliptic_stiffness(pressure, nv):
    """Eigenvalue of the elliptic mode of a ring of R = 1 at rest under a pressure from outside, whose perimeter hardly
    stretches."""
    area, q, ka, kp = np.pi, np.sqrt(4 * nv * np.tan(np.pi / nv)), 10.0, 1e5
    rest, length = area - pressure / ka, q * np.sqrt(area)
    bend = 2 * np.pi**2 / length  # energy of bending, which goes as one over the length
    tension = bend / length - 2 * pressure * area / length  # where dE/dR = 0
    law = {"kappa": 1.0, "theta0": 0.0, "kp": kp, "ka": ka, "a0": np.array([rest])}
    p = alone(nv, {**law, "p0": (length - tension / kp) / np.sqrt(rest)})
    matrix, slope = np.zeros((nv, 2, nv, 2)), np.zeros((nv, 2))
    for each in p.kind.shape_terms(p):
        np.add.at(slope, each.sites, each.gradient)
        for sites, block in zip(each.sites, each.hessian, strict=True):
            matrix[np.ix_(sites, [0, 1], sites, [0, 1])] += block
    assert np.abs(slope).max() < 1e-8
    values, modes = np.linalg.eigh(matrix.reshape(2 * nv, 2 * nv))
    x, y = p.positions.T
    ellipse = np.column_stack([(x**2 - y**2) * x, (x**2 - y**2) * y]).ravel()
    return values[np.argmax(np.abs(ellipse @ modes))]


def test_rings_buckle_under_the_pressure_of_levy():
    """3 kappa/R^3, M. Levy, J. Math. Pures Appl. 10, 5 (1884)."""
    found = [brentq(elliptic_stiffness, 2.0, 4.0, args=(nv,), xtol=1e-9) for nv in (20, 40)]
    errors = np.array(found) - 3.0
    assert abs(errors[1]) < 0.04 and errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)  # as nv^-2
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(3.0, abs=2e-3)


def test_units_and_other_views():
    p = state(3, LAWS["all"], box=9.0)
    view = View(p)
    for name in ("translated", "images", "box + k a", "180 deg", "mirror", "units, 7e2", "metres", "permuted"):
        other = VIEWS[name](view)
        found, wanted = jamlab.evaluate(other.packing), jamlab.evaluate(p)
        unit = other.k * other.s**2
        assert found.energy == pytest.approx(wanted.energy * unit, rel=1e-10), name
        largest = np.hypot(*found.forces.T).max()
        assert largest == pytest.approx(np.hypot(*wanted.forces.T).max() * unit / other.s, rel=1e-9), name
        assert np.trace(found.stress) == pytest.approx(np.trace(wanted.stress) * other.k, rel=1e-9), name


def test_a_turned_ring_has_the_same_energy():
    p, turn = state(4, LAWS["all"]), 0.7
    matrix = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    turned = p.with_state(positions=p.positions @ matrix)
    assert own(turned)[0] == pytest.approx(own(p)[0], rel=1e-13)
    close(own(turned)[1], own(p)[1] @ matrix, 1e-12)


@pytest.mark.parametrize(
    "law", [LAWS["straight"], {"kp": 2.0, "kl": 0.5, "p0": 3.6}, {"kp": 1.0, "kappa": 0.1, "theta0": 0.5}]
)
def test_free_droplets_are_at_rest(law):
    params = {"gamma": 0.4, "ka": 40.0, "delta": 0.25, "a0": np.array([0.7, 1.4])} | law
    nv = np.array([12, 17])
    areas = free_polygon_area(nv, params)
    for count, area, a0 in zip(nv, areas, params["a0"], strict=True):
        p = alone(count, {**params, "eps": 1.0, "eta": 0.0, "contact": "outline", "a0": np.array([a0])}, area)
        assert np.hypot(*jamlab.evaluate(p).forces.T).max() < 1e-12

        def energy(side, count=count, a0=a0):
            ring = regular_polygon(count, side**2)
            length = plain.size(ring[1] - ring[0]) * count
            own = plain.bending(ring, law.get("kappa", 0.0), law.get("theta0", 1.0))
            own += plain.perimeter(ring, a0, **{k: law[k] for k in ("kp", "kl", "p0") if k in law})
            return 0.4 * length + 20.0 * (side**2 - a0) ** 2 + own

        found = minimize_scalar(energy, bracket=(0.9 * np.sqrt(area), 1.1 * np.sqrt(area)), tol=1e-12)
        assert found.x**2 == pytest.approx(area, rel=1e-6)
    np.testing.assert_allclose(rest_areas_of(nv, free_area(nv, params), params), params["a0"], rtol=1e-11)


@pytest.mark.parametrize("rims", [False, True])
def test_droplets_from_outlines_have_their_areas(rims):
    square = np.array([[0, 0], [2, 0], [2, 2], [0, 2.0]])
    law = {"kl": 2.0, "p0": 3.7, "kappa": 0.05, "theta0": 0.3}
    p = jamlab.droplets_from_outlines([square, square + 4.0], [8, 8], law=law, vertices=12, rims=rims)
    area = (free_area if rims else free_polygon_area)(np.diff(p.offsets), p.params)
    np.testing.assert_allclose(area * (8 / p.box[0, 0]) ** 2, 4.0, rtol=1e-10)
    np.testing.assert_allclose(p.params["a0"], 1.0, rtol=1e-12)


def test_a_droplet_of_a_long_perimeter_has_its_rest_area():
    params = {"gamma": 0.1, "ka": 40.0, "delta": 0.2, "a0": np.array([1.0]), "kp": 2.0, "p0": 4.0}
    assert free_polygon_area(np.array([12]), params) == 1.0
    assert free_area(np.array([12]), params) == pytest.approx(1.0 + 0.1 * (4.0 - 0.05) + np.pi * 0.01, rel=1e-14)


def test_sweeps_moduli_and_response():
    law = {"kappa": 0.05, "theta0": 0.0, "kl": 0.5, "p0": 3.6}
    p = jamlab.jam(8, "dp", seed=3, law=law)
    *_, q = jamlab.compress(p, to=p.phi + 0.06, step=0.03)
    assert q.converged and q.params["kappa"] == 0.05
    moduli = [jamlab.shear_modulus(q, way) for way in ("linear-response", "finite-strain")]
    assert moduli[0] == pytest.approx(moduli[1], rel=1e-4)
    slow = jamlab.complex_modulus(q, [1e-9]).storage[0]
    assert slow == pytest.approx(jamlab.shear_modulus(q, direction="simple"), rel=1e-5)


FLOWS = (
    (1, {"kappa": 0.05, "theta0": 0.0}),
    (2, {"kp": 2.0, "p0": 3.6}),
    (2, {"gamma": 0.0, "kl": 2.0, "p0": 3.6, "kappa": 0.05}),
)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "law"), FLOWS)
def test_flow_answers_as_linear_response(seed, law):
    p = jamlab.jam(8, "dp", seed=seed, law=law)
    *_, q = jamlab.compress(p, to=p.phi + 0.08, step=0.02)
    linear, run = jamlab.complex_modulus(q, [0.1]), jamlab.oscillate(q, 0.1, 1e-4)
    assert run.storage == pytest.approx(linear.storage[0], rel=1e-3)
    assert run.loss == pytest.approx(linear.loss[0], rel=5e-3)


@pytest.mark.parametrize("ending", ["h5", "data", "dump"])
def test_files_hold_the_parameters(ending, tmp_path):
    p = state(1, LAWS["all"])
    jamlab.write(tmp_path / f"p.{ending}", p)
    found = jamlab.read(tmp_path / f"p.{ending}")
    assert {name: found.params[name] for name in LAWS["all"]} == LAWS["all"]


def test_decks_take_the_law_of_a_file_and_draw_free_droplets(tmp_path):
    p = state(1, LAWS["all"])
    jamlab.write(tmp_path / "p.data", p)
    decks = installed("lammps_inputs")
    more = 'run 0\nprint "FOUND $(pe:%.17g) ${kappa} ${theta0} ${kp} ${kl} ${p0}"\n'
    words = "-var n 8 -var seed 1 -var phi_start 0.2"
    start = f'variable dir index {decks}\ninclude "{decks}/parts/dp"\n'
    code, output = launch(tmp_path, start + more, 1, words=f"{words} -var data p.data")
    assert code == 0, output[-2000:]
    energy, *law = map(float, re.search(r"^FOUND (.*)", output, re.MULTILINE)[1].split())
    assert energy == pytest.approx(jamlab.evaluate(p).energy, rel=1e-12) and law == [*LAWS["all"].values()]
    own_law = "-var kp 1 -var p0 3.7 -var kappa 0.1 -var theta0 0.2"
    more = 'run 0\nprint "FOUND $(v_free_1:%.17g) $(v_free_2:%.17g) $(fmax)"\n'
    code, output = launch(tmp_path, start + more, 1, words=f"{words} {own_law}")
    assert code == 0, output[-2000:]
    *areas, largest = map(float, re.search(r"^FOUND (.*)", output, re.MULTILINE)[1].split())
    params = {"gamma": 0.4, "ka": 300.0, "delta": 0.25, "a0": np.array([24.0, 34.0]) ** 2 / 29**2}
    params |= {"kp": 1.0, "p0": 3.7, "kappa": 0.1, "theta0": 0.2}
    np.testing.assert_allclose(areas, free_area(np.array([12, 17]), params), rtol=1e-12)
    assert largest < 1e-10
    code, output = launch(tmp_path, start + more, 1, words=f"{words} -var kp 3 -var p0 4.2 -var gamma 0")
    assert "REFUSED: p0 = 4.2: free droplets of this shape are not round" in output


def test_flat_walls_have_no_outline():
    p = jamlab.with_walls(state(2, LAWS["all"], box=8.0), flat=True)
    terms = p.kind.terms(p, True)
    assert jamlab.evaluate(p).energy == pytest.approx(sum(each.energy.sum() for each in terms), rel=1e-12)


def test_ranks_share_outlines(tmp_path):
    p = state(2, LAWS["all"], box=6.0, lean=1.0)
    jamlab.write(tmp_path / "p.data", p)
    start = "newton {}\nvariable of_python index yes\nvariable skin index 0.1\nvariable out index x\n"
    values = {name: value for name, value in p.params.items() if name != "a0"}
    start += "".join(f"variable {name} index {value}\n" for name, value in values.items())
    start += f'include "{installed("lammps_inputs")}/parts/dp"\n'
    more = 'run 0\nprint "FOUND $(pe:%.17g) $(pxx:%.17g) $(pyy:%.17g) $(pxy:%.17g) $(fmax:%.17g)"\n'
    found = []
    for ranks, newton in ((1, "on"), (2, "on"), (2, "off")):
        code, output = launch(tmp_path, start.format(newton) + more, ranks, words="-var data p.data")
        assert code == 0, output[-2000:]
        found.append([*map(float, re.search(r"^FOUND (.*)", output, re.MULTILINE)[1].split())])
    np.testing.assert_allclose(found[1:], [found[0]] * 2, rtol=1e-10)
    assert found[0][0] == pytest.approx(jamlab.evaluate(p).energy, rel=1e-12)


BAD = [
    ({"kappa": -0.1}, "kappa", "from 0|1e-50"),
    ({"kappa": np.nan}, "kappa", "number"),
    ({"kappa": "stiff"}, "kappa", "number"),
    ({"kappa": 1e60}, "kappa", "1e"),
    ({"theta0": -1.0}, "theta0", "number"),
    ({"theta0": 1e3}, "theta0", "100"),
    ({"kp": -2.0}, "kp", "number"),
    ({"kl": [1.0]}, "kl", "number"),
    ({"p0": 0.0}, "p0", "0.001"),
    ({"p_0": 3.8}, "p_0", "p0"),
]


@pytest.mark.parametrize(("law", "name", "remedy"), BAD)
def test_bad_parameters_are_refused(law, name, remedy):
    with pytest.raises(jamlab.InputError) as caught:
        jamlab.jam(4, "dp", seed=1, law=law)
    assert name in str(caught.value) and re.search(remedy, str(caught.value)), caught.value


def test_disks_and_laws_without_a_fix_are_refused(monkeypatch):
    with pytest.raises(jamlab.InputError, match="kappa is a parameter of model dp"):
        jamlab.jam(4, law={"kappa": 0.1})

    class Mine(BendingLaw):
        name, strength = "mine", "stiff"

    with pytest.raises(jamlab.InputError, match="register an object"):
        OUTLINE_LAWS.register("mine", Mine)
    with pytest.raises(jamlab.InputError, match="its strength 'stiff' must be a parameter"):
        OUTLINE_LAWS.register("mine", Mine())
    monkeypatch.setattr(BendingLaw, "fix_style", "")
    with pytest.raises(jamlab.EngineError, match="'bending' has no fix of LAMMPS"):
        jamlab.evaluate(state(1, LAWS["round"]))


def test_an_edge_without_length_is_refused():
    p = state(1, LAWS["round"])
    positions = p.positions.copy()
    positions[1] = positions[0]
    q = p.with_state(positions=positions)
    with pytest.raises(jamlab.InputError, match="length 0"):
        own(q)
    with pytest.raises(jamlab.EngineError, match="length 0"):
        jamlab.evaluate(q)
