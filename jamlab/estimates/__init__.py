"""The cheapest packings that do, by one measured table: one packing, or a mean over packings, to an error."""
