"""From answers to marks, by nbval."""
