# Completion of pickleflight for bash: commands, options (from --help), names of scenes and other choices.
_pickleflight() {
  local cur prev words cword command=run word
  _init_completion || return
  for word in "${words[@]:1:cword-1}"; do
    case $word in run | bench | scenes | lab) command=$word && break ;; esac
  done
  case $prev in
    --scene) COMPREPLY=($(compgen -W "$("$1" scenes 2>/dev/null | cut -d' ' -f1)" -- "$cur")) && _filedir toml && return ;;
    --cues) COMPREPLY=($(compgen -W "talk" -- "$cur")) && _filedir toml && return ;;
    --record | --picture | --report | --json | --log | --save-scene | --overlay-csv | --panel-map | --dump | --checkpoint | --from) _filedir && return ;;
    --out) _filedir -d && return ;;
  esac
  if [[ $cur != -* && $prev == --* ]]; then
    # '--method NAME   collision method; impulse, spring, exact; default impulse': the list between semicolons.
    local choices
    choices=$("$1" "$command" --help 2>/dev/null |
      sed -nE "s/^ +$prev +NAME .*[;:] ([a-z-]+(, [a-z-]+)+)(;.*)?$/\1/p" | head -n 1)
    [[ -n $choices ]] && COMPREPLY=($(compgen -W "${choices//,/}" -- "$cur")) && return
  fi
  if [[ $cur == -* ]]; then
    COMPREPLY=($(compgen -W "$("$1" "$command" --help 2>/dev/null | sed -nE 's/^ +(-h,)?(-{1,2}[a-z][a-z-]*).*/\2/p')" -- "$cur"))
  elif ((cword == 1)); then
    COMPREPLY=($(compgen -W "run bench scenes lab" -- "$cur"))
    _filedir toml
  elif [[ $command == lab ]]; then
    COMPREPLY=($(compgen -W "validate work-precision stability terms all plot" -- "$cur"))
    _filedir -d
  else
    _filedir toml
  fi
} && complete -F _pickleflight pickleflight
