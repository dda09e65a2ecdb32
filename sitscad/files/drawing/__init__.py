"""Drawings: sheets, their SVG, PDF and HTML output, and pictures of board and solids."""
