"""Nets from finished files: the connections of the copper that the Gerber and drill files draw.

`differences.extract` reads a directory of finished files. `compare` compares the extracted nets with the nets that the
files name. `compare_job` compares the job file with the functions that the files declare. `panel_comparison` compares
every copy of a panel with the single board. The modules share no code with the writers of the files.
"""
