"""Everything about files of laboratories: recordings and campaigns, importers of raw files, protocols."""
