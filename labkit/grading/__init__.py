"""Grade a class: students' code runs in sandboxed workers, the instructor's checks under nbval.

Nothing that a student's notebook uses imports this package, and `labkit release` leaves it out.
"""
