"""Video models behind one interface, one a module, imported when it is used.

Each module has a function ``open_backend(options)``.
"""
