"""Positions of the sensor's parts in plan and in height. All other packages take them from here."""
