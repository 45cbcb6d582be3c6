"""The command ``tdcr``.

Exit codes: 0 done, 1 a solve did not converge (its result is printed all the same), 2 input that
cannot be used (one line on stderr), 130 interrupted, 141 the reader of the output has gone.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Sequence
from io import TextIOWrapper

import click

from tdcr import InvalidInput, __version__
from tdcr._cli import options
from tdcr._cli import output as out
from tdcr._cli.click_types import Commands, Interrupted, Unread
from tdcr._cli.commands.demo import demo
from tdcr._cli.commands.design import design
from tdcr._cli.commands.fit import fit
from tdcr._cli.commands.forward import forward, schema
from tdcr._cli.commands.inverse import inverse, track
from tdcr._cli.commands.plot import plot
from tdcr._cli.commands.workspace import workspace

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.

    Returns
    -------
    int
        Exit code.
    """
    _open_streams()
    code = 0
    try:
        code = _run(arguments)
        sys.stdout.flush()
    except (BrokenPipeError, Unread):
        # The reader has gone (| head): nothing is left to say. The code is what a shell gives
        # programs that this signal ends.
        _drop_stdout()
        return 128 + signal.SIGPIPE
    except OSError as error:
        _drop_stdout()
        # What is refused has been said.
        return code if code == 2 else _refuse(f"stdout: {error.strerror or error}")
    return code


def _drop_stdout() -> None:
    """Let go what stdout still holds, which would fail once more at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command and say what went wrong."""
    try:
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, *_, **__: out.warn(message)
            return int(_group.main(arguments, prog_name="tdcr", standalone_mode=False) or 0)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        return 0
    except click.BadParameter as error:
        missing = isinstance(error, click.MissingParameter)
        return _refuse(_one_line(error) + _see_help(error) * missing)
    except click.UsageError as error:
        return _refuse(_one_line(error) + _see_help(error))
    except click.ClickException as error:
        return _refuse(_one_line(error))
    except (click.Abort, Interrupted):
        # On a terminal the line has a ^C already.
        click.echo("\n" * sys.stderr.isatty() + "tdcr: interrupted", err=True)
        return 130
    except BrokenPipeError:
        raise
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        return _refuse(f"{name}{error.strerror or error}")
    except (InvalidInput, ImportError) as error:
        return _refuse(str(error))


def _open_streams() -> None:
    """Give what is said a place where a stream was closed (``>&-``), and any name a spelling."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, TextIOWrapper):
            # Where ASCII is all there is, a robot's name with an accent must not end the command.
            stream.reconfigure(errors="backslashreplace")


def _one_line(error: click.ClickException) -> str:
    return " ".join(error.format_message().split())


def _see_help(error: click.UsageError) -> str:
    return f" (see {error.ctx.command_path} --help)" if error.ctx else ""


def _refuse(message: str) -> int:
    """One line on stderr, however many faults there are."""
    # A key that is spelt wrong says more than the one that is missing for it.
    first, *more = sorted(message.splitlines() or [""], key=lambda x: "; did you mean" not in x)
    rest = f" (and {len(more)} more fault{'s' * (len(more) > 1)})" if more else ""
    click.echo(f"tdcr: error: {first}{rest}", err=True)
    return 2


@click.group(
    "tdcr",
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=options.examples(
        "demo --files .",
        "forward trunk.toml -d -15 free free free -5 free --unit mm",
        files=False,
    ),
)
@click.version_option(__version__, prog_name="tdcr", message="%(prog)s %(version)s")
def _group() -> None:
    """Tendon-driven continuum robots: shapes from tendon displacements, and back.

    Exit codes: 0 done, 1 a solve did not converge, 2 input that cannot be used, 130 interrupted,
    141 the reader of the output has gone.
    """


for _command in (forward, inverse, track, workspace, design, fit, plot, demo, schema):
    _group.add_command(_command)
