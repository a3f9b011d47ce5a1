"""Damaged files for every reader of the package: `make fuzz`, or `python -m fuzz --help` with `tests` on the path.

The rule: whatever a file holds, its reader gives its content or raises one of the package's own errors, within ten
seconds and a gibibyte more of address space. An input follows from seed, reader and number, so any one can be made
again. `readers.py` lists the readers; a test holds it to the code.
"""
