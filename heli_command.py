"""The entry of the command line. It imports nothing of the packages before Ctrl-C is taken care of."""

import signal


def main() -> None:
    """Run the command line ``heli``."""
    # Until a command begins there is nothing to clean up: Ctrl-C ends the process at once and without a word.
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from heli_identifier.workbench.commands import main as run

    run()
