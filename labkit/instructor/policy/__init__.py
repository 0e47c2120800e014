"""The course's own rules: from `course.toml` beside the gradebook to the points that count."""

from .apply import choose_best, ruled
from .course import NAME, Course
from .memory import course_of
from .reading import read
