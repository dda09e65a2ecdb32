"""What lies where: the pieces of the sensor in their places, from above and in height. Worked out once, here."""
