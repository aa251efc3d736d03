"""Widths, strengths and contact forms per type: mixed, adapted during a run, written and read, in runs that go on."""

import numpy as np
import outlines
import pytest
from engine.test_plugin_on_ranks import run
from outlines import DISK, EPS, RING, WALL, WIDTH


def test_pairs_of_types_by_hand(lmp, tmp_path):
    """A width and eps of their own, or eps alone with the mean of both widths; then the mixed ones, by hand."""
    state = outlines.scene(22)
    own = {(RING, WALL): (3.1, 0.22), (RING, DISK): (0.4, 0.8)}

    def law(i, j):
        return own.get((min(i, j), max(i, j)), outlines.mixed(i, j))

    outlines.start(lmp, tmp_path, state, "pair_coeff 1 2 3.1 0.22\npair_coeff 1 3 0.4 0.8\nrun 0\n")
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, law), rel=1e-12)
    own[RING, DISK] = 0.4, (WIDTH[RING] + WIDTH[DISK]) / 2
    outlines.commands(lmp, "pair_coeff 1 3 0.4\nrun 0\n")
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, law), rel=1e-12)
    for i, j in ((1, 2), (1, 3), (2, 3)):
        eps, width = outlines.mixed(i, j)
        lmp.command(f"pair_coeff {i} {j} {eps:.17g} {width:.17g}")
    lmp.command("run 0")
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state), rel=1e-12)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_contact_forms_by_type(tmp_path, ranks):
    """Two types of droplets: energy of both forms at once is the sum of each alone, the others without strength."""
    (tmp_path / "data").write_text(outlines.data(outlines.scene(23, foreign=False)))
    pairs = {(1, 1): (1.7, 0.25), (2, 2): (0.9, 0.3), (1, 2): (1.2, 0.27)}
    parts = dict(zip(pairs, [*outlines.FORMS, "outline"], strict=True))
    plain = outlines.deck("data").replace(f"walls {WALL} disks {DISK}", f"disks {DISK}")
    plain = plain.replace("group rings type 1", "set mol 1*8 type 2\ngroup rings type 1 2")
    plain += "pair_coeff 1*2 3 1.0 1.0\n"  # of a type that has no atoms here

    def deck(name, laws):
        return plain + "".join(laws) + f'run 0\nprint "state-{name} $(evdwl:%.17g) $(pe:%.17g)"\n'

    def law(pair, form, on=1):
        eps, width = pairs[pair]
        return f"pair_coeff {pair[0]} {pair[1]} {on * eps} {width} {form}\n"

    text = deck("all", [law(pair, form) for pair, form in parts.items()])
    for k, (alone, form) in enumerate(parts.items()):
        text += deck(f"only-{k}", [law(pair, form, pair == alone) for pair in pairs])
    found = run(tmp_path, text, ranks)
    single = [found[f"state-only-{k}"][0] for k in range(3)]
    assert min(single) > 0.1
    assert found["state-all"][0] == pytest.approx(sum(single), rel=1e-12)


def test_eps_and_width_change_during_a_run(lmp, tmp_path):
    """Of one type and what is mixed with it, of a pair, given or mixed: against numpy with the values of the end."""
    state = outlines.scene(24)
    ramps = {"v": "1.7,2.9", "w": "0.25,0.21", "u": "0.8,0.72", "z": f"{0.5 * (WIDTH[RING] + WIDTH[WALL]):g},0.2"}
    ramps = "".join(f"variable {name} equal ramp({ends})\n" for name, ends in ramps.items())
    change = "pair circuloline eps 1 1 v_v pair circuloline delta 1 1 v_w pair circuloline delta 1 3 v_u"
    change += " pair circuloline delta 1 2 v_z"
    more = f"pair_coeff 1 3 0.4 0.8\n{ramps}fix change all adapt 1 {change}\nrun 10\n"
    outlines.start(lmp, tmp_path, state, more)
    eps, width = EPS | {RING: 2.9}, WIDTH | {RING: 0.21}

    def law(i, j):
        if {i, j} == {RING, DISK}:
            return 0.4, 0.72
        if {i, j} == {RING, WALL}:
            return np.sqrt(eps[i] * eps[j]), 0.2
        return np.sqrt(eps[i] * eps[j]), (width[i] + width[j]) / 2

    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, law), rel=1e-12)


def test_a_width_that_grows_is_refused(lmp, tmp_path):
    """One line, with the remedy; smaller and back again is allowed, and so is growth between two runs."""
    state = outlines.scene(26)
    outlines.start(lmp, tmp_path, state, "variable w equal 0.25-0.02*(step%4)\n")
    outlines.commands(lmp, "fix change all adapt 1 pair circuloline delta 1 1 v_w\nrun 8\n")
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state), rel=1e-12)
    outlines.commands(lmp, "unfix change\npair_coeff 1 1 1.7 0.27\nrun 0\n")
    wide = WIDTH | {RING: 0.27}
    law = lambda i, j: (np.sqrt(EPS[i] * EPS[j]), (wide[i] + wide[j]) / 2)  # noqa: E731
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, law), rel=1e-12)
    lmp.command("variable grow equal 0.27+0.001*(step-8)")
    lmp.command("fix change all adapt 1 pair circuloline delta 1 1 v_grow")
    with pytest.raises(Exception, match=r"0\.27"):
        lmp.command("run 3")


LAWS = """
pair_style circuloline 0.25 1.2 contact segment/smooth walls 2 disks 3
pair_coeff 1 1 1.7 0.25 outline
pair_coeff 2 2 0.9 0.3
pair_coeff 3 3 2.5 1.25 outline
pair_coeff 1 2 1.1 0.26 outline
pair_coeff 1 3 0.4 0.8
pair_coeff 2 3 1.0 0.7 outline
"""
PRINT = 'run 0\nprint "state-{0} $(pe:%.17g) $(evdwl:%.17g) $(pxx:%.17g) $(pxy:%.17g) $(fmax:%.17g)"\n'
PROPERTY = "fix d_a0 all property/atom d_a0\n"
AGAIN = """
group rings type 1
fix area rings polygon/area 20.0 d_a0
neighbor 0.1 bin
special_bonds lj/coul 1.0 1.0 1.0
thermo_modify norm no
"""


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_files_keep_every_law(tmp_path, ranks):
    """The same bits after write_restart and read_restart, write_data with pair ij, and with mixed pairs alone."""
    (tmp_path / "data").write_text(outlines.data(outlines.scene(27)))
    style = LAWS.splitlines()[1] + "\n"
    mixed = style.replace("segment/smooth", "outline")
    deck = ""
    for name, laws in (
        ("own", LAWS),
        ("mixed", mixed + "pair_coeff 1 1 1.7\npair_coeff 2 2 0.9 0.3\npair_coeff 3 3 2.5 1.25\n"),
    ):
        deck += outlines.deck("data") + laws + PRINT.format(name)
        deck += f"write_restart {name}.restart\nwrite_data {name}.data pair {'ij' if name == 'own' else 'ii'}\n"
        head = outlines.HEAD.format(newton="on")
        deck += f"clear\nread_restart {name}.restart\n" + PROPERTY + AGAIN
        deck += PRINT.format(f"{name}-restart") + head + "bond_style line/tension\n"
        deck += (style if name == "own" else mixed) + f"read_data {name}.data fix d_a0 NULL d_a0\n" + AGAIN
        deck += PRINT.format(f"{name}-data")
    found = run(tmp_path, deck, ranks)
    for name in ("own", "mixed"):
        assert found[f"state-{name}-restart"].tolist() == found[f"state-{name}"].tolist()
        assert found[f"state-{name}-data"].tolist() == found[f"state-{name}"].tolist()


def test_types_have_labels(lmp, tmp_path):
    """In keywords of pair_style too. Restart files hold numbers, so that labels may change."""
    state = outlines.scene(22)
    outlines.start(lmp, tmp_path, state, "labelmap atom 1 ring 2 line 3 round\n")
    style = "pair_style circuloline 0.25 1.2 disks 3,round walls"
    with pytest.raises(Exception, match="square"):
        lmp.command(f"{style} square")
    laws = "".join(f"pair_coeff {k} {k} {EPS[k]} {WIDTH[k]}\n" for k in EPS)
    outlines.commands(lmp, f"{style} line\n{laws}run 0\n")
    assert lmp.get_thermo("evdwl") > 0.1
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state), rel=1e-12)
    again = f"labelmap atom 2 chain\nwrite_restart state\nclear\nread_restart state\n{PROPERTY}{AGAIN}run 0\n"
    outlines.commands(lmp, again)
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state), rel=1e-12)


MOVE = """
fix move all nve
timestep 0.002
velocity all create 0.01 7 loop geom
velocity all set NULL NULL 0.0
"""


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_run_that_goes_on(tmp_path, ranks):
    """`run N pre no` after a run is the same run, to the last digit; `run every` almost."""
    (tmp_path / "data").write_text(outlines.data(outlines.scene(29)))
    deck = ""
    ways = {"whole": "run 60\n", "parts": "run 20\nrun 20 pre no\nrun 20 pre no post no\n"}
    ways["every"] = 'run 60 every 15 "print hello"\n'
    for name, end in ways.items():
        deck += outlines.deck("data") + LAWS + MOVE + end
        deck += f'print "state-{name} $(pe:%.17g) $(ke:%.17g) $(f_area:%.17g)"\n'
    found = run(tmp_path, deck, ranks)
    assert found["state-parts"].tolist() == found["state-whole"].tolist()
    assert found["state-every"] == pytest.approx(found["state-whole"], rel=1e-12)  # has new neighbor lists
