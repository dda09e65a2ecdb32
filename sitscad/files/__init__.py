"""What a package holds: drawings, files for machines, documents, the report; nets read back out of them."""
