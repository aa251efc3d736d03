"""The cheapest packings that do, by one measured table: one to a tolerance, or a mean over packings to an error."""
