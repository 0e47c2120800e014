"""From the solutions to notebooks, the checks' numbers, and the students' kit."""
