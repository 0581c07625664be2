#include "api/axisctl/completion.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <set>

namespace axisd::axisctl {
namespace {

bool visible(const CLI::Option* option) { return !option->get_group().empty(); }

/// "--json --timeout ..." of one level.
std::string options_of(const CLI::App& app) {
  std::string text;
  for (const auto* option : app.get_options())
    if (visible(option))
      for (const auto& name : option->get_lnames()) text += fmt::format(" --{}", name);
  return text;
}

std::string subcommands_of(const CLI::App& app) {
  std::string text;
  for (const auto* command : app.get_subcommands(nullptr)) text += fmt::format(" {}", command->get_name());
  return text;
}

/// Options whose next word is a value, so that the word is not taken for an argument.
void collect_valued(const CLI::App& app, std::set<std::string>& names) {
  for (const auto* option : app.get_options())
    if (option->get_items_expected_max() > 0)
      for (const auto& name : option->get_lnames()) names.insert("--" + name);
  for (const auto* command : app.get_subcommands(nullptr)) collect_valued(*command, names);
}

/// What the words after a subcommand are: subcommands, axes (or subcommands), files or nothing. Subcommands
/// of a group follow.
std::string case_of(const CLI::App& command, const std::string& path) {
  std::string kind = "none";
  for (const auto* option : command.get_options()) {
    if (!option->get_positional()) continue;
    if (option->get_name() == "AXIS") kind = option->get_items_expected_max() > 1 ? "axes" : "axis";
    if (option->get_name() == "FILE") kind = "file";
  }
  const std::string words = subcommands_of(command);
  if (!words.empty() && kind != "axis") kind = "words";
  std::string text =
      fmt::format("    '{}') kind={}; words='{}'; options='{}' ;;\n", path, kind, words, options_of(command));
  for (const auto* part : command.get_subcommands(nullptr))
    text += case_of(*part, path + " " + part->get_name());
  return text;
}

/// "command get|command watch|...|": of the groups of subcommands.
std::string paths_of(const CLI::App& app, const std::string& before) {
  std::string text;
  for (const auto* command : app.get_subcommands(nullptr)) {
    const auto path = before + command->get_name();
    if (!before.empty()) text += path + "|";
    text += paths_of(*command, path + " ");
  }
  return text;
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::set<std::string> valued;
  collect_valued(app, valued);
  std::string cases;
  for (const auto* command : app.get_subcommands(nullptr)) cases += case_of(*command, command->get_name());
  return fmt::format(R"bash(# bash completion for axisctl; printed by `axisctl completion bash`
_axisctl() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}}
  local command='' seen=0 skip='' i word kind=words words='{0}' options='' connection=()
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${{COMP_WORDS[i]}}
    if [[ -n $skip ]]; then
      # The names of the axes are asked of the daemon that the line names.
      case $skip in --server|--tls-*) connection+=("$skip" "$word") ;; esac
      skip=''
    elif [[ ' {1} ' == *" $word "* ]]; then skip=$word
    elif [[ $word == -* ]]; then :
    elif [[ -z $command ]]; then command=$word
    elif [[ '|{4}' == *"|$command $word|"* ]]; then command="$command $word"
    else ((seen++)); fi
  done
  case $command in
{2}  esac
  case $previous in --tls-*) mapfile -t COMPREPLY < <(compgen -f -- "$current"); return ;; esac
  [[ -n $skip ]] && return
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options {3}" -- "$current")
    return
  fi
  [[ $kind == axis && $seen -gt 0 ]] && return
  [[ $kind == words && -n $command && $seen -gt 0 ]] && return
  case $kind in
    words) mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current") ;;
    axis|axes) mapfile -t COMPREPLY < <(
      compgen -W "$words $("${{COMP_WORDS[0]}}" "${{connection[@]}}" --timeout 1s list --names 2>/dev/null)" -- "$current") ;;
    file) compopt -o filenames; mapfile -t COMPREPLY < <(compgen -f -- "$current") ;;
  esac
}}
complete -F _axisctl axisctl
)bash",
                     subcommands_of(app), fmt::join(valued, " "), cases, options_of(app), paths_of(app, ""));
}

}  // namespace axisd::axisctl
