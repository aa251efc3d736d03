"""The topics of `jamlab chart speed-accuracy`."""

from jamlab.charts import (
    complex_moduli,
    droplet_models,
    minimisers,
    packing_fractions,
    protocols,
    static_modulus,
)

TOPICS = {
    "minimisers": minimisers.TOPIC,
    "steps": protocols.TOPIC,
    "packing-fraction": packing_fractions.TOPIC,
    "shear-modulus": static_modulus.TOPIC,
    "spectrum": complex_moduli.TOPIC,
    "droplets": droplet_models.TOPIC,
    "models": droplet_models.MODELS,
}
