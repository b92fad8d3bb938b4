"""What `mpmworlds verify` looks at: files, rows, values, videos, and how they agree."""
