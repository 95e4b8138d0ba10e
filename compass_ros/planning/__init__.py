"""What to record: before any fit, what shots or motions could show, and better ones of the same number or length."""
