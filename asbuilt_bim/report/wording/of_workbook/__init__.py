"""Words of the workbook: its columns, and what is said of a valuation."""
