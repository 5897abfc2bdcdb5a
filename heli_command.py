"""The entry of the command line. It imports nothing of the packages before Ctrl-C is taken care of."""

import os  # the interpreter has it already


def main() -> None:
    """Run the command line ``heli``."""
    try:
        import signal

        # Until a command begins there is nothing to clean up: Ctrl-C ends the process at once and without a word.
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
    except KeyboardInterrupt:
        os._exit(130)
    from heli_identifier.cli import main as run

    run()


if __name__ == "__main__":
    main()
