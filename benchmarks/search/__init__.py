"""Program search: what it reaches, what it sees, and what it recovers."""
