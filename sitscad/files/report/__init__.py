"""Reports on a design: findings and estimates as text and JSON, and the self-contained page of a package."""
