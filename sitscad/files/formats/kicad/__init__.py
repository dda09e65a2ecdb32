"""KiCad 9: the project of the flexible circuit, its board, its libraries and the schematic of the readout."""
