"""What is wrong with recordings that can be read: looked for before anything is computed from them."""
