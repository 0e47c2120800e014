"""`labkit site`: the course as a static site, and the students' kit in a browser without an installation."""
