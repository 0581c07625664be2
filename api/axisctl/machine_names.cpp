#include "api/axisctl/machine_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// Fields that are called so name the same thing wherever they are (proto/README.md).
bool names_by_itself(std::string_view field) {
  static const std::set<std::string_view> fields{"axis", "axes", "group", "bus", "device", "command_id"};
  return fields.contains(field);
}

/// Fields that name such a thing in some messages only.
bool names_within(const std::string& field) {
  static const std::set<std::string_view> fields{"axisd.v1.Command.id",
                                                 "axisd.v1.GetCommandRequest.id",
                                                 "axisd.v1.WatchCommandRequest.id",
                                                 "axisd.v1.CancelCommandRequest.id",
                                                 "axisd.v1.GroupMove.id",
                                                 "axisd.v1.GetGroupMoveRequest.id",
                                                 "axisd.v1.Group.name",
                                                 "axisd.v1.GroupStopResult.name",
                                                 "axisd.v1.GroupReleaseStopResult.name",
                                                 "axisd.v1.Bus.name",
                                                 "axisd.v1.Device.name",
                                                 "axisd.v1.FlightRecord.name",
                                                 "axisd.v1.GetFlightRecordRequest.name",
                                                 "axisd.v1.FlightRecordWritten.name",
                                                 "axisd.v1.WriteFlightRecordResponse.name"};
  return fields.contains(field);
}

/// The name of the axis once more, as it was typed before; of this machine anyhow.
bool repeats_name(std::string_view field) { return field == "confirm"; }

bool is_name(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_STRING &&
         (names_by_itself(field.name()) || repeats_name(field.name()) || names_within(field.full_name()));
}

using Change = std::function<std::string(const std::string& name, const FieldDescriptor& field)>;

void change_names(Message& message, const Change& change);

void change_messages(Message& message, const FieldDescriptor& field, const Change& change) {
  const auto& reflection = *message.GetReflection();
  if (!field.is_repeated()) return change_names(*reflection.MutableMessage(&message, &field), change);
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i)
    change_names(*reflection.MutableRepeatedMessage(&message, &field, i), change);
}

/// What is not set, or empty, is no name.
void change_names(Message& message, const Change& change) {
  const auto& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const auto* field : fields) {
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      change_messages(message, *field, change);
    } else if (is_name(*field) && !field->is_repeated()) {
      reflection.SetString(&message, field, change(reflection.GetString(message, field), *field));
    } else if (is_name(*field)) {
      for (int i = 0; i < reflection.FieldSize(message, field); ++i)
        reflection.SetRepeatedString(&message, field, i,
                                     change(reflection.GetRepeatedString(message, field, i), *field));
    }
  }
}

}  // namespace

std::string_view machine_in(std::string_view name) {
  const auto slash = name.find('/');
  return slash == std::string_view::npos ? std::string_view() : name.substr(0, slash);
}

std::string_view without_machine(std::string_view name) { return name.substr(name.find('/') + 1); }

std::string as_file_name(std::string name) {
  std::ranges::replace(name, '/', '-');
  return name;
}

Named take_machine(Message& request) {
  Named named;
  change_names(request, [&named](const std::string& name, const FieldDescriptor& field) {
    if (!name.contains('/')) {
      if (!repeats_name(field.name())) named.bare = name;
      return name;
    }
    const std::string machine(machine_in(name)), rest(without_machine(name));
    check_machine_name(machine);
    if (rest.empty())
      throw Failure(ExitCode::usage,
                    fmt::format("'{}' names nothing of that machine; write {}NAME", name, name));
    if (!named.machine.empty() && named.machine != machine)
      throw Failure(ExitCode::usage, fmt::format("{} and {} are two machines; this takes names of one",
                                                 named.machine, machine));
    named.machine = machine;
    return rest;
  });
  return named;
}

void put_machine(Message& answer, std::string_view machine) {
  change_names(answer, [machine](const std::string& name, const FieldDescriptor&) {
    return name.empty() ? name : fmt::format("{}/{}", machine, name);
  });
}

bool has_lease_token(const Message& request) {
  const auto& reflection = *request.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(request, &fields);
  return std::ranges::any_of(fields, [&](const FieldDescriptor* field) {
    if (field->name() == "lease_token") return true;
    return field->name() == "options" && has_lease_token(reflection.GetMessage(request, field));
  });
}

void drop_lease_token(Message& request) {
  const auto& reflection = *request.GetReflection();
  const auto& type = *request.GetDescriptor();
  if (const auto* token = type.FindFieldByName("lease_token")) reflection.ClearField(&request, token);
  if (const auto* options = type.FindFieldByName("options"); options && reflection.HasField(request, options))
    drop_lease_token(*reflection.MutableMessage(&request, options));
}

void check_machine_name(std::string_view name) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  };
  if (!name.empty() && name.front() >= 'a' && name.front() <= 'z' && std::ranges::all_of(name, fits)) return;
  throw Failure(ExitCode::usage,
                fmt::format("'{}' is no machine's name; 'axisctl machines' shows those of the cell", name));
}

}  // namespace axisd::axisctl
