"""A ball in free flight: what air and cameras do to it, after published wind tunnels and textbooks."""
