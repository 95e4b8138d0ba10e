"""A ball between two inclined plates and a basket: how it bounces, what spin and air do."""
