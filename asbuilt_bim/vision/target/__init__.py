"""The red disc: its outline in both photos, and its distance."""
