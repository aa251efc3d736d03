"""Rows of `option_table` with adhesion, bending and elastic perimeters at once: those of its rows that choose no laws of
their own, and rows of laws that change."""

from dataclasses import replace

import option_table
from option_table import FLAT, HEAD, NEARER, OWN, TILES, Row, on
from plain_forces import Law

ADHESION = ((0.1, 0.3), (0.05, 0.2), (0.02, 0.035))  # of each type: pull and range, over the width
BEND, PERIMETER = (0.02, 0.6), (0.3, 0.2, 3.7)
LAW = Law(adhesion=ADHESION, bend=BEND, perimeter=PERIMETER)
COEFFICIENTS = [line for line in HEAD.splitlines() if line.startswith("pair_coeff")]
STICKY = "".join(f"{line} adhesion {a} {b}\n" for line, (a, b) in zip(COEFFICIENTS, ADHESION, strict=True))
FIXES = """\
fix bend rings polygon/bending 0.02 0.6
fix perimeter rings polygon/perimeter 0.3 0.2 3.7 d_a0
"""
MOST_RANKS = 3  # more cost time
OTHER = ("pair_coeff", "pair_style", "respa", "{head", "bond_coeff", "polygon/", "numdiff", "create_bonds")


def with_laws(rows):
    """Those on at most three ranks that choose no law, and start where all meet."""
    for row in rows:
        if row.ranks > MOST_RANKS or row.scene != "all" or any(word in row.head + row.lines for word in OTHER):
            continue
        law = replace(row.law, adhesion=ADHESION, bend=BEND, perimeter=PERIMETER)
        yield replace(row, name=f"outline laws, {row.name}", head=f"{row.head}\n{STICKY}".lstrip(), after=FIXES, law=law)


def own(name, lines="", head="", ranks=1, **more):
    law = replace(more.pop("law", Law()), adhesion=ADHESION, bend=BEND, perimeter=PERIMETER)
    return Row(name, lines, f"{head}\n{STICKY}".lstrip(), ranks, after=FIXES, law=law, **more)


SELF_LAW = replace(LAW, near=0.1, eps=(1.7,) * 3, width=(0.25,) * 3, adhesion=(ADHESION[0],) * 3)
SELF = OWN.replace("pair_coeff * * 1.7", "pair_coeff * * 1.7 adhesion 0.1 0.3")
PATHS = [
    *with_laws(option_table.PATHS),
    *(
        Row(f"outline laws, self{words}, {n} ranks", lines, SELF + extra, n, scene="folded", law=SELF_LAW, after=FIXES)
        for n, words, lines, extra in ((1, "", "", ""), (2, ", newton off", "thermo 1", "\nnewton off"), (3, "", TILES, ""))
    ),
    *(own(f"outline laws, flat, {n} ranks", head=FLAT, ranks=n, scene="flat") for n in (1, 3)),
    own("outline laws, flat, newton off", head=f"{FLAT}\nnewton off", ranks=2, scene="flat"),
]
STATES = list(with_laws(option_table.STATES))
REFUSALS = [
    Row("bending and respa", "run_style respa 2 1 bond 1 pair 2\nrun 1", after=FIXES, said="works without run_style respa"),
]
