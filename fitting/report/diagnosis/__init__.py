"""Report of a diagnosis: `document` (report.json), `figures`, `page` (report.html)."""
