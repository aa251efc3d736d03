"""Evidence about jamlab, run from a checkout: what was measured with it, beside what papers and theory say."""
