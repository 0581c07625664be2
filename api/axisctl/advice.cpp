#include "api/axisctl/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/axisctl/machine_names.hpp"

namespace axisd::axisctl {
namespace {

/// Longer ones first, where one begins as another does.
constexpr std::pair<std::string_view, std::string_view> words[] = {
    {", or ListAxes", ""},
    {", or ListGroups", ""},
    {", or ListBuses", ""},
    {"see ListAxes", "see axisctl list"},
    {"see ListBuses", "see axisctl bus list"},
    {"CellService.ListMachines tells", "axisctl machines tells"},
    {"AxisService to move or stop", "the commands of axes to move or stop"},
    {"AxisService.Enable", "axisctl enable"},
    {"AxisService.Reset", "axisctl reset"},
    {"AxisService.SetPosition", "axisctl set-position"},
    {"AxisService.Stop", "axisctl stop"},
    {"DriveService.WriteParameters", "axisctl drive write"},
    {"DriveService.SaveParameters", "axisctl drive save"},
    {"DriveService.RestoreFactory", "axisctl drive restore"},
    {"DriveService.Readdress", "axisctl drive readdress"},
    {"DriveService.SetSerial", "axisctl drive set-serial"},
    {"leave out the metadata axisd-user and axisd-role", "leave out --as"},
    {"ask with axisd-role: ", "ask with --as USER:"},
    {"the metadata axisd-user", "the name behind --as"},
    {"the metadata axisd-role", "the role behind --as"},
    {"options.not_after passed", "what --valid-for gives was over"},
    {"options.not_after", "what --valid-for gives"},
    {"a later not_after", "a longer --valid-for"},
};

constexpr std::string_view program = "axisctl ";
/// Of a command in a text.
constexpr std::string_view ends = ",;:'()";

bool is_name_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

/// The words of a command behind its first, with `axis` as a whole word replaced.
std::string with_axis(std::string_view command, std::string_view axis, std::string_view full) {
  std::string text;
  // The first word is a command: an axis may be called as it.
  for (std::size_t at = 0, word = 0; at < command.size(); ++word) {
    std::size_t end = at;
    while (end < command.size() && is_name_letter(command[end])) ++end;
    const auto name = command.substr(at, end - at);
    text += word > 0 && name == axis ? full : name;
    while (end < command.size() && !is_name_letter(command[end])) text += command[end++];
    at = end;
  }
  return text;
}

}  // namespace

std::string in_own_words(std::string_view text) {
  std::string own(text);
  for (const auto& [theirs, ours] : words)
    for (auto at = own.find(theirs); at != own.npos; at = own.find(theirs, at + ours.size()))
      own.replace(at, theirs.size(), ours);
  return own;
}

std::string advice(std::string_view remedy, std::string_view subject) {
  auto own = in_own_words(remedy);
  const auto machine = machine_in(subject);
  if (machine.empty()) return own;
  std::string text;
  for (std::string_view rest = own;;) {
    const auto begin = std::min(rest.find(program), rest.size());
    text += rest.substr(0, begin);
    rest.remove_prefix(begin);
    if (rest.empty()) return text;
    rest.remove_prefix(program.size());
    const auto command = rest.substr(0, std::min(rest.find_first_of(ends), rest.size()));
    rest.remove_prefix(command.size());
    text += program;
    const auto named = with_axis(command, without_machine(subject), subject);
    // "axisctl machines" is asked of the entrance, and what has options says where it goes.
    if (named == command && !command.starts_with("machines") && !command.starts_with("--"))
      text += fmt::format("--machine {} ", machine);
    text += named;
  }
}

}  // namespace axisd::axisctl
