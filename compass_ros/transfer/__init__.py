"""Policies from simulators, played in a concealed real cell: Algorithm 1, and simulators compared by what scores."""
