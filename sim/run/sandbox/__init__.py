"""Confinement of programs that nobody here wrote, from within their own process.

Two layers. *Lockdown*, always: limits of the process, Landlock for files, a seccomp
filter that allows what a simulation needs. *Namespaces*, where the machine allows them:
no network, no other processes, a file system of its own. A program can neither start a
process nor leave its own, so that to kill that one is to end all of it.

`lockdown` and what it uses run in the child, before it has seen the program: they
import the standard library only, and each other by relative names, for there the
package is loaded from its folder.
"""
