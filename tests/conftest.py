"""What holds for all tests."""

import signal

# Where the tests run in the background of a shell, Ctrl-C is ignored, and so it would be by every program they start.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
