# Completion of pickleflight for bash: commands, and what --help tells: options, those that take a file, studies of the
# lab, names of scenes and other choices.
_pickleflight() {
  local cur prev words cword command=run word help
  _init_completion || return
  for word in "${words[@]:1:cword-1}"; do
    case $word in run | bench | scenes | lab) command=$word && break ;; esac
  done
  # Newer versions of CLI11 break long lines, and indent what follows.
  help=$("$1" "$command" --help 2>/dev/null | sed -E ':a;N;$!ba;s/\n {20,}/ /g')
  case $prev in
    --scene) COMPREPLY=($(compgen -W "$("$1" scenes 2>/dev/null | cut -d' ' -f1)" -- "$cur")) && _filedir toml && return ;;
    --cues) COMPREPLY=($(compgen -W "talk" -- "$cur")) && _filedir toml && return ;;
    --out) _filedir -d && return ;;
  esac
  if [[ $cur != -* && $prev == --* ]]; then
    grep -qE "^ +(-[a-z],)?$prev FILE" <<<"$help" && _filedir && return
    # '--method NAME   collision method; impulse, spring, exact; default impulse': the list between semicolons.
    local choices
    choices=$(sed -nE "s/^ +$prev +NAME .*[;:] ([a-z-]+(, [a-z-]+)+)(;.*)?$/\1/p" <<<"$help" | head -n 1)
    [[ -n $choices ]] && COMPREPLY=($(compgen -W "${choices//,/}" -- "$cur")) && return
  fi
  if [[ $cur == -* ]]; then
    COMPREPLY=($(compgen -W "$(sed -nE 's/^ +(-h,)?(-{1,2}[a-z][a-z-]*).*/\2/p' <<<"$help")" -- "$cur"))
  elif ((cword == 1)); then
    COMPREPLY=($(compgen -W "run bench scenes lab" -- "$cur"))
    _filedir toml
  elif [[ $command == lab ]]; then
    COMPREPLY=($(compgen -W "$(sed -nE 's/^ +study NAME +study: //p' <<<"$help" | tr -d ,)" -- "$cur"))
    _filedir -d
  else
    _filedir toml
  fi
} && complete -F _pickleflight pickleflight
