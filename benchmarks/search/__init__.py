"""Program search: what it recovers."""
