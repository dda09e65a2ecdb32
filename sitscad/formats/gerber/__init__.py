"""Gerber X2: the board's layers, drill map, job file and panel."""
