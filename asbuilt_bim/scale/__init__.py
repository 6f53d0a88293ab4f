"""Many stations on many processors, and what need not be done twice."""
