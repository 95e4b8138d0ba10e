"""What each law looks like in data, drawn by the library's own formulas."""
