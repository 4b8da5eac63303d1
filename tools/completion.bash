# shellcheck shell=bash
# Completes commands, options and files of fcl_fibers in bash. It asks the program's own --help.
_fcl_fibers() {
  local words
  if ((COMP_CWORD == 1)); then
    words=$("$1" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]\+\) .*/\1/p')
  fi
  words+=" $("$1" "${COMP_WORDS[@]:1:COMP_CWORD>1}" --help | grep -oE '^  -[-a-z,]+' | tr ',' ' ')"
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "${COMP_WORDS[COMP_CWORD]}")
}
complete -o default -F _fcl_fibers fcl_fibers
