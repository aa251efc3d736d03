"""Numbers of the papers, each with the margin that its printed digits give."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Distance = TypeVar("Distance", float, NDArray[np.float64])


class Published(NamedTuple):
    """A number as printed."""

    value: float  # the number
    margin: float = 0.0  # what else its words mean, see `printed`
    relation: str = "="  # "=", or ">" and "<" where the paper gives a bound only
    where: str = ""  # figure, table, equation or section that prints it


def printed(text: str, where: str, relation: str = "=", *, decimals: int = 1, error: float | None = None) -> Published:
    """Give a number that a paper prints its margin, by one rule for all: the error that the paper states; else half a
    unit of the last decimal. What is printed without decimals, or said in words such as "constant", counts as printed
    to `decimals`: one, but two where it is a part of a whole (of area, voids, rho, phi, A). Fractions such as 1/4 count
    as printed to two. A number that the paper prints in two ways has the margin that holds both. Bounds have none."""
    value = float(Fraction(text))
    if relation != "=":
        return Published(value, 0.0, relation, where)
    shown = f"{value:.2f}" if "/" in text else text
    margin = 0.5 * 10.0 ** -max(decimals, len(shown.partition(".")[2]))
    return Published(value, margin if error is None else error, relation, where)


# [B] tables 1 and 2, fits of eqs 13 and 14: z = z_J + z_0 d^0.5 + z_1 d and G = G_0 d^0.5 + G_1 d, d the distance from
# onset in phi or rho; G of SP in eps/s_LS^2, of DP in eps_r/l^2. Table 1: z_J, onset, z_0, z_1; table 2: G_0, G_1
TABLE_1 = {"SP(φ)": (3.97, 0.84, 3.7, 0.0), "SP(ρ)": (3.97, 0.84, 2.6, 4.0), "DP(ρ)": (3.97, 0.835, 3.3, 7.1)}
TABLE_2 = {"SP(φ)": (0.42, 0.0), "SP(ρ)": (0.38, 0.35), "DP(ρ)": (0.07, 1.7)}


# stress of steady flow at onset goes as this power of the rate, by linear drag: the critical regime of Tighe et al.,
# Phys. Rev. Lett. 105, 088303 (2010)
FLOW_AT_ONSET = printed("1/2", "Tighe et al. 2010", error=0.0)  # as before: its rows may not gain by a margin

# critical point, exponent of stress over rate there, of the yield stress and of the viscosity, with drag against the
# mean flow and corrections to scaling: Olsson & Teitel, Phys. Rev. E 83, 030302 (2011)
JAMMING_IN_SHEAR = printed("0.84347", "Olsson & Teitel 2011", error=0.0002)
STRESS_AT_ONSET = printed("0.28", "Olsson & Teitel 2011", error=0.02)
YIELD_EXPONENT = printed("1.08", "Olsson & Teitel 2011", error=0.03)
VISCOSITY_EXPONENT = printed("2.77", "Olsson & Teitel 2011", error=0.2)

# strain at which the answer of soft disks to shear stops being linear goes as this power of the pressure: Boschan et
# al., Soft Matter 12, 5450 (2016)
SOFTENING_EXPONENT = printed("1", "Boschan et al. 2016")


# abstracts of arXiv: G of disks goes in proportion to contacts beyond isostatic, while B stays (Ellenbroek et al. 2009,
# 0907.0012); these contacts go as the root of the pressure (Wyart et al. 2005, cond-mat/0508415)
SHEAR_IN_CONTACTS = printed("1", "Ellenbroek et al. 2009")
COMPRESSION_IN_CONTACTS = printed("0", "Ellenbroek et al. 2009")
CONTACTS_IN_PRESSURE = printed("1/2", "Wyart et al. 2005")

# gaps h and forces f at onset go as h^-gamma, f^theta at bucklers and f^theta' elsewhere; stability asks for gamma >=
# 1/(2 + theta') and gamma >= (1 - theta)/2 (Lerner et al. 2013, 1302.3990)
BOUND_BY_OTHERS = printed("0", "Lerner et al. 2013", ">")
BOUND_BY_BUCKLERS = printed("0", "Lerner et al. 2013", ">")

# amorphous packings of bidisperse disks jam from here to there, by the rate of cooling (Schreck et al. 2011, 1007.2162)
ONSETS_OF_SCHRECK = (0.84, 0.853)


def table_law(coefficients: tuple[float, ...], distance: Distance) -> Distance:
    """c_0 d^0.5 + c_1 d at a distance d from onset, [B] eqs 13 and 14."""
    c_0, c_1 = coefficients
    value: Distance = c_0 * distance**0.5 + c_1 * distance
    return value


def table_contacts(series: str, distance: Distance) -> Distance:
    """z at a distance from onset, by the fit of table 1, which is not valid above z = 6, the most there can be."""
    z_j, _, *coefficients = TABLE_1[series]
    return z_j + table_law(tuple(coefficients), distance)


def table_modulus(series: str, distance: Distance) -> Distance:
    """G at a distance from onset, by the fit of table 2."""
    return table_law(TABLE_2[series], distance)


def table_entry(value: float) -> Published:
    """A coefficient z_k or G_k of the tables, which print one decimal from 1 on and two below."""
    return printed(f"{value:g}", "[B] sec 3, tables 1 and 2")


def table_onset(value: float) -> Published:
    """z_J, phi_J or rho_J of table 1, known to 0.005."""
    return printed(f"{value:g}", "[B] sec 3, table 1", error=0.005)


# [B] fig 4 and eq 11: rho - rho_J = C (dphi - dphi^1.5); shape factors A and areas a
EQ_11_C = printed("1.21", "[B] caption of fig 11 b")
EQ_11_C_OF_TEXT = printed("1.2", "[B] appendix")
RHO_AT_UNIT_PHI = printed("0.95", "[B] fig 1")
RHO_AT_DENSEST = printed("1", "[B] sec 3", decimals=2)  # phi = 1.24, eq 12
RHO_AS_PHI = printed("0.88", "[B] sec 3, fig 4 a")  # phi up to which rho is about phi
THREE_OVERLAP = printed("0", "[B] sec 3, eq 9", decimals=2)  # of rho: what three disks share up to phi = 1.2
AREA_FALLS = printed("0.04", "[B] sec 3, fig 4 b")  # drho where <a> begins to leave a_J
LOST_AREA_EXPONENT = 2.5  # of 1 - <a>/a_J in drho, far from onset; fig 11 again
SHAPE_EXPONENTS = (0.67, 0.3)  # of drho in A - A_J, small and large A
LAMBDA_OF_SHAPE = printed("0.67", "[B] caption of fig 4 c")  # of dphi in A - 1
OMEGA_OF_CAPTION = printed("0.5", "[B] caption of fig 4 c")  # of drho in A - 1, small A - 1
SHAPES = {  # mean A of packings: model, N, rho
    ("sp", 64, 0.92): printed("1.01", "[B] fig 2"),
    ("dp", 64, 0.92): printed("1.03", "[B] fig 2"),
    ("dp", 128, 0.9895): printed("1.06", "[B] fig 3"),  # 0.99 as printed
}
SHAPE_AT_UNIT_PHI = printed("1.03", "[B] caption of fig 4 c")
SHAPE_OF_DENSE_DISKS = printed("1.10", "[B] sec 3, fig 4 c", ">")
SHAPE_AT_CONFLUENCE = printed("1.07", "[B] sec 3, fig 4 c")
CONFLUENCE = 0.16  # drho at which droplets are confluent
AREA_OF_DENSE_DROPLETS = printed("1", "[B] sec 3, fig 4 b", decimals=2)

# [B] figs 5 to 7
AT_CONFLUENCE = printed("0.16", "[B] sec 3, fig 4 c")  # drho
PROPORTIONAL = printed("1", "[B] abstract, sec 4")  # exponent of G in z - z_J
SIMILAR = printed("1", "[B] sec 3, fig 5")  # z, G of DP over SP near onset; of large N over small N
MODELS_PART = printed("0.88", "[B] sec 3, fig 5")  # rho
ALPHA_0 = printed("0.5", "[B] sec 3, fig 6 a")  # z - z_J ~ dphi^alpha_0
BETA_0 = printed("0.5", "[B] sec 3, fig 6 d")  # G ~ dphi^beta_0
ROOT_NEAR_ONSET = printed("0.5", "[B] abstract, sec 4")  # of z - z_J and of G in drho, droplets
DROPLET_EXPONENT = printed("0.8", "[B] sec 3, fig 6 c, f")  # of z - z_J and of G in drho
CROSSOVER_EXPONENT = printed("2", "[B] sec 3, fig 6")  # a of the crossover at dphi N^a
NEAREST_REGIME = (1e-4, 1e-3)  # distance from onset: between the steps of [B] sec 2.3 and the end of regime 1, sec 3
REGIME_1 = {  # exponents of z - z_J and of G nearest to onset
    "z": printed("1.0", "[B] sec 3, fig 6 a, c"),
    "g": printed("0", "[B] sec 3, fig 6 d, f"),
}
DOTTED_SLOPE = printed("0.8", "[B] caption of fig 6")  # of G, disks too
LARGER_RATIO = printed("1", "[B] abstract, sec 3, tables 1 and 2", ">")  # C_1/C_0, DP over SP
EQ_13_ENDS = printed("0.98", "[B] sec 3, fig 5 a")  # rho from which z of disks leaves eq 13
COLLAPSE_OF_SIZES = printed("0", "[B] sec 3, insets of fig 7")  # slope of (z_conf - z) N in N
CONFLUENT_LIMIT = printed("0", "[B] sec 3", decimals=2)  # 1 - rho* of large droplet packings
MISSING_CONTACTS_LIMIT = printed("2", "[B] sec 3, fig 7")  # (z_conf - z) N of disks at confluence
MISSING_CONTACTS_EXPONENT = printed("1", "[B] sec 3, figs 7 and 9")  # of z_conf - z in rho* - rho, droplets

# [B] fig 8
VOID_SHARES = {  # P_l near onset
    sides: printed(share, "[B] sec 3, fig 8 a") for sides, share in ((3, "0.4"), (4, "0.4"), (5, "0.18"), (6, "0.02"))
}
TRIANGLES_FROM = 0.97  # rho from which all voids of droplets have three sides
DENSE_DROPLET_TRIANGLES = printed("1", "[B] sec 3, fig 8 a", decimals=2)  # P_3 from there on
PLATEAU_SHAPE = printed("4.87", "[B] sec 3")
DENSE_DISK_TRIANGLES = printed("1", "[B] sec 3, fig 8 a", "<")  # P_3 below rho = 1
SAME_VOIDS = printed("0", "[B] sec 3, fig 8 a", decimals=2)  # P_3 at onset, DP less SP
TRIANGLES_FOR_SQUARES = printed("1", "[B] sec 3, fig 8 a")  # by how much P_4 of DP falls over that by which P_3 rises
MORE_TRIANGLES = printed("0.88", "[B] sec 3, fig 8 a")  # rho, P_3 of DP over SP
DENSE_DISK_TRIANGLES_SHAPE = printed("2", "[B] sec 3", "<")
EXPERIMENTS = printed("0", "[B] sec 3, fig 9", decimals=2)  # droplets less experiments

# [B] fig 10
THETA = printed("0.55", "[B] appendix, fig 10")  # sigma ~ N^-theta
ONSET_LIMIT = printed("0.842", "[B] appendix, fig 10")

SAME_ONSETS = printed("0", "[B] sec 4, appendix, table 1", error=0.005)  # mean rho_J of DP less phi_J of SP

# [B] fig 11
KAPPA = printed("0.75", "[B] appendix, fig 11 a")  # phi - rho ~ (U/N)^kappa
OVERLAP_IN_PHI = printed("1.5", "[B] appendix, fig 11 a")  # phi - rho ~ dphi^1.5, of which kappa follows
PHI_IN_ENERGY = printed("0.5", "[B] appendix, fig 11 a")  # dphi ~ (U/N)^0.5
ZETA = tuple(printed(v, "[B] appendix, fig 11 c") for v in ("1.5", "2.5"))  # 1 - <a>/a_J ~ drho^zeta, small and large
OMEGA = {  # drho ~ (A - A_J)^omega, small and large A; of disks the text has 0.66, the caption 0.67
    "sp": (printed("0.665", "[B] appendix, fig 11 d", error=0.01), printed("0.3", "[B] appendix, fig 11 d")),
    "dp": (printed("1.0", "[B] appendix, fig 11 e"), printed("0.3", "[B] appendix, fig 11 e")),
}

# O'Hern et al., Phys. Rev. E 68, 011306 (2003): correction N^-0.7 of the mean onset
ONSET_CORRECTION = 0.7

# [T] figs 1, 3 and 6
SIZE = 32_768  # disks
ORDER = 0.5  # decades: what is "of order 1" is nearer to 1 than to 10 or 1/10
KELVIN_VOIGT_SLOPE = printed("1", "[T] Introduction, fig 1")  # of G'' at both ends of the spectrum
STORAGE_AT_ENDS = printed("0", "[T] Introduction, fig 1")  # slope of G' at both ends
CRITICAL_SLOPE = printed("0.5", "[T] Introduction, Balanced damping, fig 1")  # of G' and G'' between them
MU = printed("1/2", "[T] Balanced damping, fig 3")  # G_0 ~ p^mu
LAMBDA = printed("1", "[T] Balanced damping, fig 3")  # tau* ~ p^-lambda
DELTA = printed("0.5", "[T] Balanced damping, fig 3")  # G* ~ omega^Delta, with 1/2 beside
QUASISTATIC_ENDS = printed("0", "[T] Balanced damping, fig 3 b", error=ORDER)  # decades of omega/p
CRITICAL_ENDS = printed("0", "[T] Balanced damping, fig 3 a", error=ORDER)  # decades of omega

# what follows from the equations, whatever the packings are, is held to the digits that tables keep
EXACT = 1e-3
FLUID_VISCOSITY = printed("1", "[T] Stokes drag, fig 6 b", error=EXACT)  # d eta_0 / d eta_F
UNDAMPED_LOSS = printed("0", "[T] Imbalanced contact damping, eq 18", error=EXACT)  # G''/(omega G_0) - 1 at beta = 0
SLIDING_VISCOSITY = printed("1", "[T] Relation to floppiness, eq 22", error=EXACT)  # of eta_0(beta) - eta_0(0) in beta

# [T] text on figs 3, 4 and 6
UNDAMPED_VISCOSITY = printed("1/2", "[T] Relation to floppiness, eq 22")  # exponent of eta_0 in p, beta = 0
BETA_STAR = printed("1", "[T] Relation to floppiness")  # beta* ~ p
NO_SLOW_TIME = printed("0", "[T] Imbalanced contact damping, fig 4 a")  # of G_0/eta_0 in p, beta = 0
CROSSOVER_TO_AFFINE = printed("0", "[T] Balanced damping, fig 3")  # exponent of it in p
WITHOUT_ROTATIONS = printed("0.5", "[T] The bubble model")  # Delta, of disks that do not turn
DRAG_EXPONENT = 2 / 3  # alpha of Bretherton's law, eq 9
NONLINEAR_SLOPES = {  # eqs 27 to 29
    "slow G''": printed("2/3", "[T] Nonlinear damping, eq 27"),
    "critical G'": printed("1/3", "[T] Nonlinear damping, eq 28"),
    "critical G''": printed("1/3", "[T] Nonlinear damping, eq 29"),
}

# [T] figs 5, 7 and 8
MEAN_APPROACH = printed("0", "[T] Relation to floppiness, text on fig 5")  # its exponent in p, plateau
MEAN_AS_MEDIAN = printed("0", "[T] Relation to floppiness, text on fig 5")  # of mean over median in p
INDEPENDENT = printed("1", "[T] Correlations, fig 7 a")  # l at one end of omega or p over that at the other
SAME_LENGTH = printed("1", "[T] Correlations", decimals=2)  # l of other lanes, or of the imaginary part, over l
OF_THE_BOX = printed("0", "[T] Correlations, fig 7 a")  # exponent of l/L in N
MOVES_OUT = printed("0", "[T] Correlations, fig 7 b", "<")  # exponent in omega of where C is least, Stokes drag
SMALL_ENDS = printed("0", "[T] Finite size effects, fig 8", error=ORDER)  # decades of p N^2
SHALLOWER = printed("-1/2", "[T] Finite size effects, fig 8", ">")  # slope with pre-stress
STOKES_AS_CONTACT = printed("1", "[T] Finite size effects, fig 8")  # a that it considers likely
HIGHEST_PRESSURE = 1e-2  # of the packings of fig 3, in k
SLOW_SHEAR = {  # exponents in p of displacements per strain
    name: printed(value, "[T] Relation to floppiness, fig 5")
    for name, value in (("approach", "1/4"), ("sliding", "-1/4"), ("nonaffine", "-1/4"))
}
CORRELATION_LENGTH = printed("1/4", "[T] Correlations, fig 7")  # l/L, where the box cuts it off
LOG_EXPONENT = printed("0.65", "[T] Correlations, fig 7 d")  # l (-ln p)^0.65
SIZE_EXPONENT = {  # a: eta_0/N^a against p N^2
    law: printed(a, "[T] Finite size effects, fig 8") for law, a in (("contact", "1.0"), ("stokes", "1.09"))
}
# slope of eta_0/N^a for large p N^2, no pre-stress: -a/2; under Stokes drag "slightly shallower"
VISCOSITY_TAIL = {
    "contact": printed("-0.5", "[T] Finite size effects, fig 8", error=0.025),  # a = 1.0
    "stokes": printed("-0.545", "[T] Finite size effects, fig 8", ">"),
}
