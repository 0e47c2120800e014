"""`labkit mark`: written answers marked in the browser, by several readers at once."""
