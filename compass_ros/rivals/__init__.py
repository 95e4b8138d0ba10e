"""What others would do with the same recordings: parameters alone, regression on accelerations, a test, a black box."""
