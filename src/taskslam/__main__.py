"""`python -m taskslam`: the command line, where its script is not on the path."""

from taskslam.cli.main import main

if __name__ == "__main__":
    main()
