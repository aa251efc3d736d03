"""List the topics of `jamlab chart speed-accuracy`."""

from jamlab.benchmarks.speed_accuracy import (
    droplet_models,
    minimisers,
    packing_fractions,
    shear_modulus,
    spectra,
    sweep_steps,
)

TOPICS = {
    "minimisers": minimisers.TOPIC,
    "steps": sweep_steps.TOPIC,
    "packing-fraction": packing_fractions.TOPIC,
    "shear-modulus": shear_modulus.TOPIC,
    "spectrum": spectra.TOPIC,
    "droplets": droplet_models.TOPIC,
    "models": droplet_models.MODELS,
}
