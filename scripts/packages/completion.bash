# Completion of nscdd in bash: its commands and options are those that its own help names.
_nscdd() {
    local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]-}
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        mapfile -t COMPREPLY < <(compgen -W "$(nscdd --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p') --help --version" -- "$word")
    elif [[ $word == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$(nscdd "$command" --help 2>/dev/null | sed -n 's/^  *\(-[a-z],\)\{0,1\}\(--[a-z][a-z-]*\).*/\2/p')" -- "$word")
    fi
}
complete -o default -F _nscdd nscdd
