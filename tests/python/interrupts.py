"""What the tests of Ctrl-C share."""

import signal
import subprocess
import sys
import textwrap
import threading
from contextlib import contextmanager

# Ends what hangs, and decides nothing else: a call that listens needs a thousandth of it [s].
HANG = 300.0


def handler(at_work):
    """Statements that make a process say at every Ctrl-C whether it is at work; the third time that
    it is, it is interrupted. `at_work` is of the frame that is interrupted.
    """
    return f"""\
import os, signal
last, left = None, 3
def within(frame, function):
    return frame is not None and (
        frame.f_code is function.__code__ or within(frame.f_back, function)
    )
def called(frame):
    return frame.f_code.co_filename == "<string>" and frame.f_code.co_name != "<module>"
def on_signal(_, frame):
    global last, left
    here, last = last, (frame, frame.f_lasti)
    working = {at_work}
    left -= working
    if left == 0:
        raise KeyboardInterrupt
    os.write(2, b"at work\\n" if working else b"on the way\\n")
signal.signal(signal.SIGINT, on_signal)
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


def interrupt(process):
    """Send Ctrl-C until the process was at work three times; two of them it has only looked at."""
    seen = 0
    while seen < 2:
        process.send_signal(signal.SIGINT)
        said = process.stderr.readline()
        assert said in ("at work\n", "on the way\n")
        seen += said == "at work\n"
    process.send_signal(signal.SIGINT)


def assert_interrupts(setup, call):
    """Run statements, then a call, in a new process; Ctrl-C must end it.

    It is at work where two looks find it at the same place, which is a call of compiled code, or in
    what that calls.
    """
    code = f"""\
{textwrap.dedent(setup)}
{handler("called(frame) or here == last")}
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
else:
    print("finished", flush=True)
"""
    with started(code) as process:
        assert process.stdout.readline() == "ready\n"
        interrupt(process)
        assert process.communicate() == ("interrupted\n", "")
        assert process.returncode == 0
