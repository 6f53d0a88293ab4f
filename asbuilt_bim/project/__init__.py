"""What the user wrote in a project file, checked, and the files and photos that it names."""
