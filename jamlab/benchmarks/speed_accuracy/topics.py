"""List the topics of `jamlab chart speed-accuracy`."""

from jamlab.benchmarks.other_codes import descents
from jamlab.benchmarks.speed_accuracy import (
    disk_minimisers,
    droplet_minimisers,
    moduli,
    onset_search,
    packing_fractions,
    spectra,
)

TOPICS = {
    "disk-minimisers": disk_minimisers.TOPIC,
    "droplet-minimisers": droplet_minimisers.TOPIC,
    "onset": onset_search.TOPIC,
    "packing-fraction": packing_fractions.TOPIC,
    "shear-modulus": moduli.TOPIC,
    "spectrum": spectra.TOPIC,
    "other-codes": descents.TOPIC,
}
