"""What lies where, its CAD solids, and how it fits."""
