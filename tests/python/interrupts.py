"""What the tests of Ctrl-C share."""

import subprocess
import sys
import textwrap
import threading
from contextlib import contextmanager

# Ends what hangs, and decides nothing else: a call that listens needs a thousandth of it [s].
HANG = 120.0


def interrupts(at_work):
    """Statements that interrupt the process when it is at work, at the third look that it takes.

    At the first two its handler only counts: that it is at work and listens is known then, and no
    time was waited for. `at_work` is of the frame of the main thread and the one before.
    """
    return f"""\
import os, signal, sys, threading, time
looks = 0
def on_signal(*_):
    global looks
    looks += 1
    if looks == 3:
        raise KeyboardInterrupt
def within(frame, function):
    return frame is not None and (
        frame.f_code is function.__code__ or within(frame.f_back, function)
    )
def called(frame):
    return frame.f_code.co_filename == "<string>" and frame.f_code.co_name != "<module>"
def press(main=threading.get_ident()):
    here = None
    for count in range(3):
        while True:
            time.sleep(0.001)
            frame = sys._current_frames()[main]
            before, here = here, (frame, frame.f_lasti)
            if {at_work}:
                break
        os.kill(os.getpid(), signal.SIGINT)
        while looks == count:
            time.sleep(0.001)
signal.signal(signal.SIGINT, on_signal)
threading.Thread(target=press, daemon=True).start()
"""


@contextmanager
def started(code, *arguments):
    """A Python process that runs code, with pipes, killed where it hangs."""
    command = [sys.executable, "-c", code, *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as process:
        watchdog = threading.Timer(HANG, process.kill)
        watchdog.start()
        try:
            yield process
        finally:
            watchdog.cancel()
            process.kill()


def assert_interrupts(setup, call):
    """Run statements, then a call, in a new process; Ctrl-C must end it.

    It is at work where it is found at the same place again, which is a call of compiled code, or in
    what that calls.
    """
    code = f"""\
{textwrap.dedent(setup)}
{interrupts("called(frame) or here == before")}
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
else:
    print("finished", flush=True)
"""
    with started(code) as process:
        assert process.communicate() == ("interrupted\n", "")
        assert process.returncode == 0
