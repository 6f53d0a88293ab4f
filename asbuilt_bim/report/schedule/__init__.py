"""Schedules as MS Project, Primavera P6 and spreadsheets read them."""
