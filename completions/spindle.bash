# bash completion for spindle. The candidates come from the program itself, offline.

_spindle() {
  local line=${COMP_LINE:0:COMP_POINT} word before text quoted more=no
  local -a words lines
  read -ra words <<<"$line"
  [[ $line == *[[:space:]] ]] && words+=("")
  # The shell splits words at '=' and ':'; spindle wants them whole, and quotes are the shell's.
  word=${words[-1]#[\'\"]}
  words[-1]=$word
  before=${word%"$2"}
  [[ $2 == [=:] ]] && before=$word
  mapfile -t lines < <("$1" __complete "${words[@]:1}" 2>/dev/null)
  COMPREPLY=()
  for text in "${lines[@]:1}"; do
    text=${text%%$'\t'*}
    text=${text#"$before"}
    [[ $text == *[=.:] ]] && more=yes
    printf -v quoted %q "$text"
    COMPREPLY+=("$quoted")
  done
  [[ $more == yes ]] && compopt -o nospace
  case ${lines[0]-} in
    files) mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "$word") ;;
    folders) mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -d -- "$word") ;;
    *) return 0 ;;
  esac
  compopt -o filenames
} 2>/dev/null

complete -F _spindle spindle
