"""From recordings and a simulator to parameters: the paper's method, ours, and the rivals, behind one interface."""
