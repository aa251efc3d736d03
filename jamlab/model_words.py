"""Words by which users name a model, and the model's own name."""

MODEL_NAMES = {"disks": "sp", "disk": "sp", "droplets": "dp", "polygons": "dp", "sp": "sp", "dp": "dp"}
