"""Measurements behind estimate, choose and choose_flow."""
