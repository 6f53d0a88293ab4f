"""What the person at the terminal sees: progress, tables, messages; and what each command does."""
