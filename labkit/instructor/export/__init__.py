"""The labs for other graders: nbgrader, Gradescope, GitHub Classroom."""

KINDS = {"nbgrader": "course", "gradescope": "container", "github-classroom": "repository"}  # what, and its module
KEPT = ("nbgrader_config.py",)  # what an export never writes over
ALLOWED = ("weak_sandbox", "trust_students")  # what a course may allow, as with the options of labkit grade
SETTINGS = "labkit.json"  # what of an export its autograder reads
