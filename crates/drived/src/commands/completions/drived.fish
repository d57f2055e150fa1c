# fish completion for drived: drived completions fish > ~/.config/fish/completions/drived.fish
# The program answers itself, with the names of the running daemon. The first line says whether files are meant as well.
function __drived_complete
    set --local words (commandline --current-process --tokenize --cut-at-cursor)
    set --local told ($words[1] completions fish -- $words (commandline --current-token --cut-at-cursor) 2>/dev/null)
    string join \n -- $told[2..]
    if test "$told[1]" = files
        __fish_complete_path (commandline --current-token)
    end
end
complete --command drived --no-files --keep-order --arguments '(__drived_complete)'
