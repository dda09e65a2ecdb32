"""SIT1xx: rules for the drawn board, against the limits of the fabricator and the connector."""
