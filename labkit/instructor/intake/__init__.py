"""From what an LMS or a person packed to one notebook of each student."""
