"""Concealed worlds by other hands: robots whose physics is written apart from the suite's simulator and its laws.

Nothing here imports MuJoCo, or the simulator, the laws or the methods that are judged (test/worlds/test_apart.py).
"""
