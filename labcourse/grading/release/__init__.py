"""What students get: their notebooks, derived from the solutions; the course's folder, and its zip."""
