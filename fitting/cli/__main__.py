"""`python -m fitting.cli`, the same as `pneusma`."""

from . import main

main(prog_name="pneusma")
