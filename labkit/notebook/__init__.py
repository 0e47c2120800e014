"""A student's notebook: reading it, finding answers in it, running what they need."""
