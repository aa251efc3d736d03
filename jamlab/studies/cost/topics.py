"""List the topics of `jamlab chart speed-accuracy`."""

from jamlab.studies.cost import (
    disk_minimisers,
    droplet_minimisers,
    droplet_spectra,
    droplet_vertices,
    ensemble_means,
    flow_in_time,
    flow_solvers,
    moduli,
    onset_search,
    packing_fractions,
    peer_descents,
    pressure_packing,
    spectra,
)

TOPICS = {
    "disk-minimisers": disk_minimisers.TOPIC,
    "droplet-minimisers": droplet_minimisers.TOPIC,
    "onset-search": onset_search.TOPIC,
    "pressure-packing": pressure_packing.TOPIC,
    "packing-fraction": packing_fractions.TOPIC,
    "shear-modulus": moduli.TOPIC,
    "spectrum": spectra.TOPIC,
    "droplet-spectrum": droplet_spectra.TOPIC,
    "droplet-vertices": droplet_vertices.TOPIC,
    "flow-in-time": flow_in_time.TOPIC,
    "flow-solvers": flow_solvers.TOPIC,
    "ensemble-means": ensemble_means.TOPIC,
    "other-codes": peer_descents.TOPIC,
}
