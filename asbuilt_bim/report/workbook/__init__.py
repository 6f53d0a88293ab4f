"""The workbook for cost control."""
