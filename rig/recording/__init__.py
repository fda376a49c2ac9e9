"""What came, as records with the times it came, and the file that keeps them."""
