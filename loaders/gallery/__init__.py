"""A page on which one looks at the samples of a release, without a server."""
