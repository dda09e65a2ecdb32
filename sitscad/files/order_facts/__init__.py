"""Ordering facts of the flexible circuit: files of the set, holes, notes, and the fingerprint of the images."""
