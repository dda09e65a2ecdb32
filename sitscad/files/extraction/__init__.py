"""Nets out of finished files: what the copper that the Gerber and drill files draw really joins.

`differences.extract` reads a directory of finished files; `compare` holds the nets found against the nets that the same
files name, and what files say of themselves against the job file; `panel` holds every copy of a panel against the
single board. Nothing here knows how the files were written.
"""
