"""The completion script of bash, which zsh takes too.

All that it offers but the names of cases and of files stands in the script, so that pressing Tab
starts no program. Candidates are compared by the shell itself: `compgen -W` would expand them.
"""

import shlex

from cases.programs import ROOT
from compare.shell.surface import CHOICE, NOTHING, Argument, Command, keys

ZSH = """\
(( $+functions[compdef] )) || { autoload -U +X compinit && compinit; }
autoload -U +X bashcompinit && bashcompinit
"""

HEAD = """\
# Completion of grainpair for {shell}, made by: grainpair completion {shell}
{start}
_grainpair_cases() {{
  local file
  for file in {root}/cases/*/case.toml; do
    file=${{file%/case.toml}}
    printf '%s\\n' "${{file##*/}}"
  done
}}
"""

# $1 is what is offered, a line each; $2 the start of the word.
BODY = """\
_grainpair_offer() {
  local one
  while IFS= read -r one; do
    [[ -n $one && $one == "$2"* ]] && COMPREPLY+=("$one")
  done <<<"$1"
}

# Offers values of the kind $1 (its choices on further lines) for the word $2.
_grainpair_value() {
  local kind=${1%%$'\\n'*} key
  case $kind in
    case)
      _grainpair_offer "$(_grainpair_cases)" "$2"
      if [[ ${#COMPREPLY[@]} == 0 || $2 == */* ]]; then
        compopt -o filenames 2>/dev/null
        _grainpair_offer "$(compgen -f -- "$2")" "$2"
      fi ;;
    file) compopt -o filenames 2>/dev/null; _grainpair_offer "$(compgen -f -- "$2")" "$2" ;;
    folder) compopt -o filenames 2>/dev/null; _grainpair_offer "$(compgen -d -- "$2")" "$2" ;;
    key)
      if [[ $2 == *=* ]]; then
        key=${2%%=*}
        _grainpair_offer "$(_grainpair_values "$key")" "$2"
      else
        compopt -o nospace 2>/dev/null
        _grainpair_offer "$_grainpair_keys" "$2"
      fi ;;
    choice) _grainpair_offer "${1#*$'\\n'}" "$2" ;;
  esac
}

_grainpair() {
  COMPREPLY=()
  # Bash takes = for a word of its own: what belongs together is joined again.
  local -a words
  local i word glue='' last=-1
  words=()
  for ((i = 0; i <= COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    if [[ $last -gt 0 && ( $glue || $word == = ) ]]; then
      words[last]+=$word
    else
      last=$((last + 1))
      words[last]=$word
    fi
    [[ $word == = ]] && glue=1 || glue=''
  done
  local cur=${words[last]} command=${words[1]} stem='' prefix='' kind='' place=1 previous
  [[ $cur == *=* ]] && stem=${cur%=*}=
  if [[ $last -le 1 ]]; then
    _grainpair_offer "$_grainpair_commands" "$cur"
    return
  fi
  previous=${words[last - 1]}
  if [[ $cur == --*=* ]]; then
    previous=${cur%%=*} prefix=${cur%%=*}= cur=${cur#*=}
  fi
  if [[ $previous == -* ]]; then
    kind=$(_grainpair_takes "$command" "$previous")
  fi
  if [[ -n $kind ]]; then
    _grainpair_value "$kind" "$cur"
  elif [[ $cur == -* ]]; then
    _grainpair_offer "$(_grainpair_options "$command")" "$cur"
  else
    for ((i = 2; i < last; i++)); do
      [[ ${words[i]} == -* ]] && continue
      [[ ${words[i - 1]} == -* && -n $(_grainpair_takes "$command" "${words[i - 1]}") ]] && continue
      place=$((place + 1))
    done
    _grainpair_value "$(_grainpair_takes "$command" "$place")" "$cur"
  fi
  for ((i = 0; i < ${#COMPREPLY[@]}; i++)); do
    COMPREPLY[i]=$prefix${COMPREPLY[i]}
    [[ $COMP_WORDBREAKS == *=* ]] && COMPREPLY[i]=${COMPREPLY[i]#"$stem"}
  done
}

complete -F _grainpair grainpair
"""


def script(shell: str, commands: list[Command]) -> str:
    """What the shell is to read, for `shell` bash or zsh."""
    known = keys()
    values = {key: [f"{key}={one}" for one in listed] for key, listed in known.items() if listed}
    return "\n".join(
        [
            HEAD.format(
                shell=shell, root=shlex.quote(str(ROOT)), start=ZSH if shell == "zsh" else ""
            ),
            f"_grainpair_commands={lines([one.name for one in commands])}",
            f"_grainpair_keys={lines([f'{key}=' for key in known])}",
            "",
            table("_grainpair_values", "$1", values),
            table("_grainpair_options", "$1", {one.name: flags(one) for one in commands}),
            "# What follows an option, or is the word of that number: its kind, and its choices.",
            table("_grainpair_takes", "$1 $2", taken(commands)),
            BODY,
        ]
    )


def lines(words: list[str]) -> str:
    """Words as one word of the shell, a line each."""
    return shlex.quote("\n".join(words))


def flags(command: Command) -> list[str]:
    return [flag for one in command.options for flag in one.flags if flag.startswith("--")]


def taken(commands: list[Command]) -> dict[str, list[str]]:
    """By command and option, or command and number of the word, the kind and the choices."""
    out: dict[str, list[str]] = {}
    for command in commands:
        for one in command.options:
            if one.takes != NOTHING:
                out |= {f"{command.name} {flag}": kind(one) for flag in one.flags}
        for number, one in enumerate(command.words, start=1):
            out[f"{command.name} {number}"] = kind(one)
            if one.several:
                out[f"{command.name} *"] = kind(one)
    return out


def kind(argument: Argument) -> list[str]:
    return [argument.takes, *(argument.choices if argument.takes == CHOICE else ())]


def table(name: str, asked: str, answers: dict[str, list[str]]) -> str:
    """A function of the shell that prints the answer to `asked`, or nothing."""
    rows = []
    for question, answer in answers.items():
        start, star, _ = question.partition("*")
        pattern = f"{shlex.quote(start)}[0-9]*" if star else shlex.quote(question)
        rows.append(f"    {pattern}) printf '%s\\n' {lines(answer)} ;;")
    return "\n".join([f"{name}() {{", f'  case "{asked}" in', *rows, "  esac", "}", ""])
