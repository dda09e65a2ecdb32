"""Files of a package: drawings, files for machines, documents, report; and nets extracted from finished files."""
