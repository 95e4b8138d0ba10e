"""Concealed worlds: recordings of a table whose wrong parameters and missing physics are sealed meanwhile.

The physics here is written apart from `simulation/effects` and differs from it on purpose; neither imports the other.
"""
