"""Rooms of evidence: what was measured with jamlab, drawn beside what papers and theory say."""
