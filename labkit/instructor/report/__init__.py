"""From marks to people: gradebook, tables, pages, the LMS's files."""
