"""From the winding to the converter: leads, neighbours, tank and drive."""
