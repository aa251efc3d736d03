"""The topics of `jamlab chart speed-accuracy`."""

from jamlab.charts import minimisers, packing_fractions, protocols, spectra_topic, static_modulus

TOPICS = {
    "minimisers": minimisers.TOPIC,
    "steps": protocols.TOPIC,
    "packing-fraction": packing_fractions.TOPIC,
    "shear-modulus": static_modulus.TOPIC,
    "spectrum": spectra_topic.TOPIC,
}
