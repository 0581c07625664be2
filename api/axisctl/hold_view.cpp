#include "api/axisctl/hold_view.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include "api/axisctl/lease_option.hpp"

namespace axisd::axisctl {

using google::protobuf::util::TimeUtil;

std::string text_of(const v1::StopHold& hold) {
  const auto since = TimeUtil::SecondsToTimestamp(TimeUtil::TimestampToSeconds(hold.since()));
  return fmt::format("{}{} since {}{}", hold.holder(),
                     hold.request_id().empty() ? "" : fmt::format(" (request {})", hold.request_id()),
                     TimeUtil::ToString(since), hold.durable() ? "" : ", not durable");
}

std::string text_of(const google::protobuf::RepeatedPtrField<v1::StopHold>& holds) {
  std::string text;
  for (const auto& hold : holds) text += (text.empty() ? "" : ", ") + text_of(hold);
  return text;
}

std::string released_line(const std::string& axis,
                          const google::protobuf::RepeatedPtrField<v1::StopHold>& holds) {
  return holds.empty() ? fmt::format("{}: released; a new command can move it", axis)
                       : fmt::format("{}: released; still held by {}", axis, text_of(holds));
}

void ReleaseArguments::add_to(CLI::App& command) {
  auto* named =
      command.add_option("--request-id", request_id, "The hold of the stop with this id")->type_name("ID");
  auto* own = command.add_flag("--mine", mine, "All holds of this client, of its other programs, too");
  command.add_flag("--everybody", everybody, "The holds of all clients: needs the lease where there is one")
      ->excludes(named)
      ->excludes(own);
  own->excludes(named);
  add_lease(command, lease_token);
}

void add_hold_id(CLI::App& command, std::string& request_id) {
  command
      .add_option("--request-id", request_id,
                  "With --hold: hold by this name, and so apart from other holds of this client")
      ->type_name("ID");
}

}  // namespace axisd::axisctl
