"""SIT1xx: what is drawn, against what the fabricator makes and the connector takes."""
