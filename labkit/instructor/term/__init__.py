"""A term: one page over all labs of a gradebook, and similar code side by side."""
