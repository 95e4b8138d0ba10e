"""A first cell from a model and recordings: what is what is matched by name and by motion, and said in the YAML."""
