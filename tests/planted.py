"""Programs that also do what no program of a scene does."""


def planted(program, mark):
    """Return a program that makes a file, if it can, before it does what it did."""
    return (
        f"try:\n    open({str(mark)!r}, 'w').close()\n"
        f"except OSError:\n    pass\n{program}"
    )
