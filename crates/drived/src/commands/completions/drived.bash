# bash completion for drived: drived completions bash > ~/.local/share/bash-completion/completions/drived
# The program answers itself, with the names of the running daemon. It is given the line up to the cursor, because bash
# breaks words at @, : and = too, and what bash takes for the word; the first line says whether files are meant as well.
_drived() {
    local IFS=$'\n' kind= line
    COMPREPLY=()
    while IFS= read -r line; do
        if [[ -z $kind ]]; then
            kind=$line
        else
            COMPREPLY+=("$line")
        fi
    done < <("$1" completions bash -- "${COMP_LINE:0:COMP_POINT}" "$2" 2>/dev/null)
    if [[ $kind == files ]]; then
        compopt +o nospace -o filenames 2>/dev/null
        COMPREPLY+=($(compgen -f -- "$2"))
    fi
}
complete -o nospace -F _drived drived
