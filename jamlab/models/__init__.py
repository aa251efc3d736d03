"""The models, each in one file behind one protocol, and the pair laws of their contacts."""
