"""Studies: from requirements to the designs that meet them best."""
