"""Viscous drag, the equation of motion, G*(omega) and its scaling near jamming."""
