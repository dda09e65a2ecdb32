"""The rules, what mends a finding, findings in text and JSON, and which of them count."""
