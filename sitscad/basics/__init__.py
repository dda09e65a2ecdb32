"""Parts that all other folders use: quantities with units, frozen records, findings, argument checks, the version."""
