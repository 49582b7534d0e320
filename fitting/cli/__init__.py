"""The `pneusma` command: parses and calls; a subcommand lives in its own module, imported when it runs.

Importing this module must stay cheap (no JAX, no matplotlib), so that `pneusma --help` answers at once. Every
error that a user can cause ends here, as one line on stderr and exit code 2.
"""

import atexit
import difflib
import errno
import gc
import importlib
import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from ._lock import locked
from ._made_by import with_record

# name -> (module, function, line in the list of commands)
COMMANDS = {
    "simulate": (
        "fitting.cli.simulate",
        "simulate_command",
        "Predict one state of an actuator, or every row of a recording.",
    ),
    "workspace": (
        "fitting.cli.workspace",
        "workspace_command",
        "Curvature and bend angle over pressure and activation.",
    ),
    "design": (
        "fitting.cli.design",
        "design_command",
        "Find the dimensions that do best what is wanted.",
    ),
    "invert": (
        "fitting.cli.invert",
        "invert_command",
        "Find the pressure and phases for what is wanted.",
    ),
    "control": (
        "fitting.cli.control",
        "control_command",
        "Hold a curvature by resistances, on a plant with unknown physics.",
    ),
    "wiring": (
        "fitting.cli.wiring",
        "wiring_command",
        "Select many springs on one pair of wires by filters.",
    ),
    "reproduce": (
        "fitting.cli.reproduce",
        "reproduce_command",
        "Draw the published figures and check what the source states.",
    ),
    "check": (
        "fitting.cli.check",
        "check_command",
        "Check the installed model against exact values.",
    ),
    "import": (
        "fitting.cli.import_",
        "import_command",
        "Turn raw files of a laboratory into recordings.",
    ),
    "plan": (
        "fitting.cli.plan",
        "plan_command",
        "Plan the first campaign for a new alloy.",
    ),
    "synthesise": (
        "fitting.cli.synthesise",
        "synthesise_command",
        "Simulate a campaign with a known truth.",
    ),
    "characterise": (
        "fitting.cli.characterise",
        "characterise_command",
        "Fit a material to a campaign of recordings and report on it.",
    ),
    "characterise-batch": (
        "fitting.cli.characterise_batch",
        "characterise_batch_command",
        "Characterise many specimens: one table, one hierarchical summary.",
    ),
    "effects": (
        "fitting.cli.effects",
        "effects_command",
        "List and explain the physics that the published model leaves out.",
    ),
    "diagnose": (
        "fitting.cli.diagnose",
        "diagnose_command",
        "Say what physics the model leaves out, and show the fit improve.",
    ),
    "posterior": (
        "fitting.cli.posterior",
        "posterior_command",
        "Sample what a campaign says of its parameters.",
    ),
    "completion": (
        "fitting.cli.completion",
        "completion_command",
        "Print the script that lets a shell complete commands and options.",
    ),
    "propagate": (
        "fitting.cli.propagate",
        "propagate_command",
        "Propagate uncertain inputs through the model, in any number of rows.",
    ),
}
OTHER_WORDS = {
    "fit": "characterise", "calibrate": "characterise", "identify": "characterise", "predict": "simulate",
    "solve": "simulate", "optimise": "design", "optimize": "design", "inverse": "invert",
    "sample": "posterior", "uncertainty": "propagate", "explain": "diagnose", "convert": "import",
    "read": "import", "generate": "synthesise", "test": "check", "help": "--help", "version": "--version",
}  # fmt: skip
"""Words that other programs have for these commands."""
UNUSABLE_INPUT = 2  # exit code
NO_NUMBER = re.compile(r"is not a (valid|number)|must be (a number|NAME=VALUE)")
"""Words of a line that refuses a text for a number."""
DISTRUSTED = r"(?s).*: do not trust its numbers\. "
"""Beginning of the message of `pneusma_jax.errors.Distrusted`, whose module loads late."""
DECIMAL_COMMA = re.compile(r"(?<![\d.,])([+-]?\d+),(\d+)(?![\d.,])")
"""A number with a decimal comma, which separates no list of three or more."""


class LazyGroup(click.Group):
    """A group that knows its commands by name and imports one only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands, in the order of a first session."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """Import and return a command, or None if there is no such one."""
        if name not in COMMANDS:
            return None
        # Read when SciPy loads its BLAS. Factoring tall, thin Jacobians in several threads that wait for each
        # other is up to a hundred times slower than in one, where other programs or fits use the cores.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        # Read when JAX is loaded. XLA reports compilations of more than a minute or two as alarms that ask
        # for a bug report; errors still end in exceptions.
        os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
        # Imports and traced programs are millions of objects that stay. The usual threshold of 700 has them
        # looked through again and again, which takes a tenth of a command's time.
        gc.set_threshold(50_000, 20, 50)
        module, function, _ = COMMANDS[name]
        return locked(with_record(getattr(importlib.import_module(module), function), name), name)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple:
        """Find the command that the arguments call; a mistyped one is answered with the nearest."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from pneusma_jax.errors import nearest

            meant = OTHER_WORDS.get(args[0].lower())
            hint = f"did you mean {meant!r}?" if meant else nearest(args[0], COMMANDS)
            raise click.UsageError(f"there is no command {args[0]!r}, {hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands from the table, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, _, line) in COMMANDS.items()])

    def main(self, args: list[str] | None = None, prog_name: str | None = None, **extra: Any) -> Any:
        """Run, and turn what a user can cause into one line on stderr and an exit code."""
        if not extra.pop("standalone_mode", True):
            return super().main(args, prog_name, standalone_mode=False, **extra)
        if args is None:  # from a shell
            # Python ends by looking for cycles among all objects, which takes 0.3 s once JAX is loaded.
            atexit.register(gc.freeze)
            if not sys.warnoptions:  # what libraries warn of is for developers
                warnings.simplefilter("ignore")
        args = list(sys.argv[1:] if args is None else args) or ["--help"]
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):  # a terminal without UTF-8 gets ? for what it cannot show
                stream.reconfigure(errors="replace")
        try:
            with _telling_distrust():
                code = super().main(args, prog_name, standalone_mode=False, **extra)
        except click.exceptions.Abort:
            _leave("interrupted", 130)
        except click.ClickException as error:
            _leave(_usage_line(error))
        except OSError as error:
            if error.errno == errno.EPIPE:
                # the reader (`head`, `less`) has gone: that is its right
                sys.stdout = None
                sys.exit(0)
            _leave(_file_line(error))
        except ValueError as error:
            if not _is_input_error(error):
                raise
            _leave(str(error))
        sys.exit(code if isinstance(code, int) else 0)


@contextmanager
def _telling_distrust() -> Iterator[None]:
    """Tell warnings of files whose numbers are not to be trusted as notes, each once, whatever is ignored."""
    told: set[str] = set()
    with warnings.catch_warnings():
        warnings.filterwarnings("always", message=DISTRUSTED)
        shown = warnings.showwarning

        def tell(message: Warning | str, category: type[Warning], *place: Any) -> None:
            text = " ".join(str(message).split())
            if not re.match(DISTRUSTED, text):
                shown(message, category, *place)
            elif text not in told:
                told.add(text)
                click.echo(f"note: {text}", err=True)

        warnings.showwarning = tell
        yield


def _leave(message: str, code: int = UNUSABLE_INPUT) -> None:
    """Say one line on stderr and end."""
    from pneusma_jax.errors import shortened

    line = _with_point(" ".join(part.strip() for part in message.splitlines()))
    click.echo(f"pneusma: {shortened(line)}", err=True)
    sys.exit(code)


def _with_point(line: str) -> str:
    """The line, with a hint where it refuses a number that has a decimal comma."""
    comma = DECIMAL_COMMA.search(line) if NO_NUMBER.search(line) else None
    return f"{line}; decimals have a point: {comma[1]}.{comma[2]}" if comma else line


def _usage_line(error: click.ClickException) -> str:
    """A click error without its usage block."""
    if isinstance(error, click.NoSuchOption):  # click compares dashes, too: --help would be like --model
        plain = error.option_name.lstrip("-")
        known = {one.lstrip("-"): one for one in error.possibilities or ()}
        error.possibilities = [known[name] for name in difflib.get_close_matches(plain, known)] or None
    message = error.format_message().strip()
    if isinstance(error, click.UsageError):  # others begin with a path
        message = message[:1].lower() + message[1:]
    context = getattr(error, "ctx", None)
    if isinstance(error, click.UsageError) and context is not None:
        called = context.command_path.split(" ", 1)[-1] if context.parent else ""
        return f"{message.rstrip('.')}; see `pneusma {called} --help`".replace("  ", " ")
    return message


def _file_line(error: OSError) -> str:
    """Line with the system's message about a file."""
    named = f"{error.filename}: " if error.filename else ""
    return f"{named}{(error.strerror or str(error)).lower()}"


def _is_input_error(error: ValueError) -> bool:
    """True for the package's own `InputError`; its module is loaded if anything has raised one."""
    errors = sys.modules.get("pneusma_jax.errors")
    return errors is not None and isinstance(error, errors.InputError)


@click.group(
    cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110}
)
@click.version_option(package_name="pneusma-jax", prog_name="pneusma")
def main() -> None:
    """Model and characterise pneumatic soft actuators with resistance-sensed nitinol springs.

    Pressures are gauge. Columns of files carry their unit. Unusable input ends in one line and exit code 2.
    """
