// What the shells evaluate: each hands the words to `axisctl complete-words` and shows what it answers.
#include <map>

#include "api/axisctl/completion.hpp"

namespace axisd::axisctl {
namespace {

// bash takes "=" and ":" for words of their own, and completes what is behind the last of them.
constexpr const char* bash = R"bash(# bash completion for axisctl; printed by `axisctl completion bash`
_axisctl() {
  local words=() word current before
  for word in "${COMP_WORDS[@]:1:COMP_CWORD}"; do
    if [[ ${#words[@]} -gt 0 && ( $word == [=:]* || ${words[-1]} == *[=:] ) ]]; then words[-1]+=$word
    else words+=("$word"); fi
  done
  current=${words[-1]-}
  before=${current%"${current##*[=:]}"}
  mapfile -t COMPREPLY < <("${COMP_WORDS[0]}" complete-words "${words[@]}" 2>/dev/null)
  if [[ ${COMPREPLY[0]-} == :files ]]; then
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "${current#"$before"}")
    return
  fi
  COMPREPLY=("${COMPREPLY[@]%%$'\t'*}")
  COMPREPLY=("${COMPREPLY[@]#"$before"}")
  [[ ${COMPREPLY[0]-} == *= ]] && compopt -o nospace 2>/dev/null
  return 0
}
complete -F _axisctl axisctl
)bash";

constexpr const char* zsh = R"zsh(#compdef axisctl
# zsh completion for axisctl; printed by `axisctl completion zsh`
_axisctl() {
  local line text
  local -a lines plain assigned
  lines=("${(@f)$("${words[1]}" complete-words "${(@Q)words[2,CURRENT-1]}" "$PREFIX" 2>/dev/null)}")
  if [[ ${lines[1]} == :files ]]; then
    compset -P '*='
    _files
    return
  fi
  for line in $lines; do
    text=${${line%%$'\t'*}//:/\\:}
    [[ $line == *$'\t'* ]] && text+=:${line#*$'\t'}
    if [[ ${line%%$'\t'*} == *= ]]; then assigned+=($text); else plain+=($text); fi
  done
  (( $#plain )) && _describe axisctl plain
  (( $#assigned )) && _describe axisctl assigned -S ''
}
if [[ $funcstack[1] == _axisctl ]]; then _axisctl "$@"; else compdef _axisctl axisctl; fi
)zsh";

constexpr const char* fish = R"fish(# fish completion for axisctl; printed by `axisctl completion fish`
function __axisctl_complete
    set -l words (commandline -opc)
    set -l current (commandline -ct)
    set -l found ($words[1] complete-words $words[2..-1] "$current" 2>/dev/null)
    if test "$found[1]" = :files
        __fish_complete_path "$current"
    else if set -q found[1]
        printf '%s\n' $found
    end
end
complete -c axisctl -f -a '(__axisctl_complete)'
)fish";

const std::map<std::string_view, const char*> scripts{{"bash", bash}, {"fish", fish}, {"zsh", zsh}};

}  // namespace

const std::vector<std::string>& completion_shells() {
  static const std::vector<std::string> shells{"bash", "zsh", "fish"};
  return shells;
}

std::string completion_script(std::string_view shell) { return scripts.at(shell); }

}  // namespace axisd::axisctl
