"""What is missing where no name fits: sparse terms with units, beside a flexible baseline."""
