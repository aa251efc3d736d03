"""Compiled inner loops of analysis and protocols, in C++ under `plugin/kernels`, called with numpy arrays."""
