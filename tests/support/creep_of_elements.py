"""Creep of a sum of Maxwell elements beside a spring and a dashpot, exactly."""

import numpy as np


def compliance(spectrum, time):
    """J(t) of spring, dashpot and Maxwell elements: strain under unit stress of a linear system of equations.

    g_0 gamma + eta gamma' + sum g_i (gamma - x_i) = 1 with x_i' = lambda_i (gamma - x_i).
    """
    rates, strengths = spectrum.rates, spectrum.strengths
    size = len(rates) + 1
    matrix, drive = np.zeros((size, size)), np.zeros(size)
    matrix[0, 0] = -(spectrum.g0 + strengths.sum()) / spectrum.eta_inf
    matrix[0, 1:] = strengths / spectrum.eta_inf
    matrix[1:, 0], matrix[1:, 1:] = rates, -np.diag(rates)
    drive[0] = 1 / spectrum.eta_inf
    values, vectors = np.linalg.eig(matrix)
    amplitudes = np.linalg.solve(vectors, drive)
    return np.real(vectors[0] @ ((np.expm1(np.outer(values, time)) / values[:, None]) * amplitudes[:, None]))
