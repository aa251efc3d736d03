"""Ensembles: which strains the box of a packing may take, and what is said of a modulus below 0."""

from typing import get_args

from jamlab.arguments.choices import Ensemble

ENSEMBLES = get_args(Ensemble)
REMEDY_OF_NEGATIVE_G = "Use the ensemble 'shear-stabilized'"
NEGATIVE_G = f"< 0: the packing is unstable to shear at this box shape. {REMEDY_OF_NEGATIVE_G}"
