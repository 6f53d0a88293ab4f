"""As-built quantities into a workbook of the user's own: only mapped cells change."""
