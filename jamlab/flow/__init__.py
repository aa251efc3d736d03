"""Overdamped rheology in time: start-up, steady flow, oscillation, creep and relaxation of packings."""
