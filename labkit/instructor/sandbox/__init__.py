"""Students' code, shut in; what passes between it and the grader."""
