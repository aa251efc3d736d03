"""Processes side by side on the cores of this machine, which die with the one that started them."""
