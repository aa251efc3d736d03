"""The topics of `jamlab chart speed-accuracy`."""

from jamlab.benchmarks.speed_accuracy import droplet_models, minimisers, packing_fractions
from jamlab.benchmarks.speed_accuracy import shear_modulus as static_modulus
from jamlab.benchmarks.speed_accuracy import spectra as complex_moduli
from jamlab.benchmarks.speed_accuracy import sweep_steps as protocols

TOPICS = {
    "minimisers": minimisers.TOPIC,
    "steps": protocols.TOPIC,
    "packing-fraction": packing_fractions.TOPIC,
    "shear-modulus": static_modulus.TOPIC,
    "spectrum": complex_moduli.TOPIC,
    "droplets": droplet_models.TOPIC,
    "models": droplet_models.MODELS,
}
