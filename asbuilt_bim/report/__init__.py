"""Views of one result: document, tables, page, pictures."""
