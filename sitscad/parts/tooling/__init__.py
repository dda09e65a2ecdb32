"""What a sensor is made with and does not keep: the jig for gluing, the moulds for elastomer and skin."""
