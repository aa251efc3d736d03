"""What stored observables mean whose names are easily mistaken for another quantity."""

LABELS = {
    "g": "relaxed shear modulus, mean over directions",
    "g_x": "relaxed shear modulus G_xy, for shear along x of the box",
    "b": "relaxed bulk modulus",
}
