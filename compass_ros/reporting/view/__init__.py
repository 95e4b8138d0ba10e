"""A `Result` in the words and numbers that the report prints."""
