"""A conclusion on paper: `document` (report.json), `figures`, `page` (report.html)."""
