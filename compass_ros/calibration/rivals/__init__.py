"""What others would use on the same `Problem`, each with its published settings."""
