"""Print a completion script: commands, options, cases and keys by the Tab key.

In ~/.bashrc: source <(…/grainpair completion bash); in ~/.zshrc the same of zsh.
"""

from compare.shell import completion, surface

TARGETS = ()


def arguments(parser):
    parser.add_argument("shell", choices=["bash", "zsh"])


def run(options) -> int:
    print(completion.script(options.shell, surface.commands()), end="")
    return 0
