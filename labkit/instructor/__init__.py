"""What instructors and maintainers run; it never ships to students.

hand-ins -> intake -> exam (sandbox) -> report; authoring makes what is handed out.
"""
