#compdef drived
# zsh completion for drived: drived completions zsh > "${fpath[1]}/_drived"
# The program answers itself, with the names of the running daemon. The first line says whether files are meant as well;
# each other begins with + where a word is whole and with - where it goes on, and has a tab before what it means.
_drived() {
    local -a told whole said_whole part said_part
    local line word said
    told=("${(@f)$("${(Q)words[1]}" completions zsh -- "${(@Q)words[1,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)}")
    for line in "${(@)told[2,-1]}"; do
        word=${${line#?}%%$'\t'*}
        said=${line#*$'\t'}
        said=$word${said:+  -- $said}
        if [[ $line == +* ]]; then
            whole+=("$word") said_whole+=("$said")
        else
            part+=("$word") said_part+=("$said")
        fi
    done
    # Letters match in either case: acc is ACC.
    local -a as=(-l -V drived -M 'm:{[:lower:][:upper:]}={[:upper:][:lower:]}')
    (( $#whole )) && compadd "$as[@]" -d said_whole -a whole
    (( $#part )) && compadd "$as[@]" -S '' -d said_part -a part
    [[ $told[1] == files ]] && _files
}
if [[ $funcstack[1] == _drived ]]; then
    _drived "$@"
else
    compdef _drived drived
fi
