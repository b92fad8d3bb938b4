"""Which scenes a corpus has: candidates, trials, templates, the manifest."""
