"""`python -m firmware_sim`: simulated joints as a process of their own."""

from firmware_sim.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
