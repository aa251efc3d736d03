"""Who touches whom, areas, shapes, packing fractions, cells; droplets in pictures."""
