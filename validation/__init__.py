"""Evidence that model and tools are sound: published figures, a self-check, a blind trial."""
