"""What stored observables mean whose names are easily mistaken for another quantity."""

LABELS = {
    "g": "relaxed shear modulus, mean over directions",
    "g_x": "relaxed shear modulus G_xy, for shear along x of the box",
    "b": "relaxed bulk modulus",
}
NEGATIVE_G = "below 0: at this box shape the packing would shear by itself; ensemble shear-stabilized lets it"
