"""Everything that meets data, files and people: recordings, fits, reports, the command line."""
