"""What the tests of Ctrl-C share."""

import signal
import subprocess
import sys
import textwrap
import time


def assert_interrupts(setup, call):
    """Run statements, then a call, in a new process; Ctrl-C after half a second must end it."""
    code = f"""\
import signal
{textwrap.dedent(setup)}
# A shell's background job starts with SIGINT ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
else:
    print("finished", flush=True)
"""
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        begin = time.perf_counter()
        assert process.stdout.readline() == "interrupted\n"
        # 50 ms between looks at signals; the rest is for a busy machine.
        assert time.perf_counter() - begin < 2.0
        assert process.wait(timeout=30) == 0
