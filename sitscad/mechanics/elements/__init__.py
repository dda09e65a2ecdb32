"""Mixed finite elements of a bonded pad: the law's yardstick, and an answer at will for one design."""
