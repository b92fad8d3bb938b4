"""Results -> what is published of them: tables, ranking, figures, a page."""
