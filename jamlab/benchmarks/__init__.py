"""Benchmarks: what methods cost, where they fail, and what other codes give."""
