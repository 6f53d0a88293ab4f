"""A result as flat tables for ERP and reporting programs: one row of each thing and visit."""
