"""What a diagnosis leaves behind: diagnosis.json, parameters.json, report.html, each whole or not at all."""
