"""Tables 1 and 2 of Boromand et al.: contacts and shear modulus above onset.

z = z_J + z_0 d^0.5 + z_1 d and G = G_0 d^0.5 + G_1 d, with d the distance from onset in phi or rho; G of SP in
eps/s_LS^2, of DP in eps_r/l^2.
"""

TABLE_1 = {"SP(φ)": (3.97, 0.84, 3.7, 0.0), "SP(ρ)": (3.97, 0.84, 2.6, 4.0), "DP(ρ)": (3.97, 0.835, 3.3, 7.1)}
TABLE_2 = {"SP(φ)": (0.42, 0.0), "SP(ρ)": (0.38, 0.35), "DP(ρ)": (0.07, 1.7)}


def table_contacts(series: str, distance: float) -> float:
    """z at a distance from onset, by the fit of table 1; above 6, the most there can be, it means nothing."""
    z_j, _, z_0, z_1 = TABLE_1[series]
    return z_j + z_0 * float(distance**0.5) + z_1 * distance


def table_modulus(series: str, distance: float) -> float:
    """G at a distance from onset, by the fit of table 2."""
    g_0, g_1 = TABLE_2[series]
    return g_0 * float(distance**0.5) + g_1 * distance
