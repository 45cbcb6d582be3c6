"""Settings that all tests share."""

import signal

# A shell starts background jobs with Ctrl-C ignored, which the tests of interrupts must hear.
signal.signal(signal.SIGINT, signal.default_int_handler)
