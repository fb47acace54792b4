"""`python -m motm_wbc` is `motm`."""

from motm_wbc.cli import main

main()
