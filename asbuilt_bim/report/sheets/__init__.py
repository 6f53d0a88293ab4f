"""Sheets to print to scale: calibration boards, markers, the target."""
