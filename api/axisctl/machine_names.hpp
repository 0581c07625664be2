// Names of a cell: "press-2/feeder" is the axis `feeder` of the machine `press-2`. Pure.
#pragma once

#include <google/protobuf/message.h>

#include <optional>
#include <string>
#include <string_view>

namespace axisd::axisctl {

/// "press-2" of "press-2/feeder"; empty: it names no machine.
[[nodiscard]] std::string_view machine_in(std::string_view name);
/// "feeder" of "press-2/feeder", and of "feeder".
[[nodiscard]] std::string_view without_machine(std::string_view name);
/// For a file: "press-2-feeder".
[[nodiscard]] std::string as_file_name(std::string name);

/// What a request names, as far as machines go.
struct Named {
  std::string machine;              ///< empty: none of its names has one
  std::optional<std::string> bare;  ///< a name without a machine, if there is one
};

/// Takes the machine off all names in a request: of axes, groups, buses, devices and commands. Throws Failure
/// (usage) if they are of several machines, or name one and nothing of it.
[[nodiscard]] Named take_machine(google::protobuf::Message& request);
/// Puts it before all names in an answer.
void put_machine(google::protobuf::Message& answer, std::string_view machine);

/// Whether it carries the token of a lease.
[[nodiscard]] bool has_lease_token(const google::protobuf::Message& request);
void drop_lease_token(google::protobuf::Message& request);

/// Throws Failure (usage) unless it can be a machine's name.
void check_machine_name(std::string_view name);

}  // namespace axisd::axisctl
