"""A visit before it is measured: its stations checked on site, and what is worth a station."""
