"""How the sensor is put together and what is measured on it: steps, pictures, proofs and weights."""
