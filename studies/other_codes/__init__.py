"""The same packings in other codes."""
