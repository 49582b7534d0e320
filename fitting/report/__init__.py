"""Words, figures, pages and files, made from results; nothing here fits or simulates."""
