"""`pneusma completion`: the script that lets a shell complete commands and options."""

import click
from click.shell_completion import get_completion_class

SHELLS = ("bash", "zsh", "fish")


@click.command("completion")
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion_command(context: click.Context, shell: str) -> None:
    """Print the completion script of a SHELL.

    \b
    bash, zsh:  put  eval "$(pneusma completion bash)"  into ~/.bashrc or, with zsh, into ~/.zshrc
    fish:       pneusma completion fish > ~/.config/fish/completions/pneusma.fish
    """
    script = get_completion_class(shell)(context.find_root().command, {}, "pneusma", "_PNEUSMA_COMPLETE")
    click.echo(script.source())
