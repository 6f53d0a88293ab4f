"""What the program is measured by; README.md says what each script shows. Run them as scripts."""
