// drive parameters|read|write.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <vector>

#include "api/axisctl/drive_commands.hpp"
#include "api/axisctl/drive_view.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/lease_option.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "config/text.hpp"

namespace axisd::axisctl {
namespace {

using Stub = v1::DriveService::Stub;

struct Arguments {
  std::string axis, pattern;
  std::vector<std::string> names;
  std::uint64_t lease_token = 0;
  bool read = false, describe = false;
};

v1::ListParametersResponse catalogue_of(Invocation& invocation, const std::string& axis) {
  v1::ListParametersRequest request;
  request.set_axis(axis);
  return invocation.client().call(&Stub::ListParameters, request, axis);
}

/// Names as they are; addresses ("6041h:00", "0x0010") as the catalogue names them.
class Names {
 public:
  Names(Invocation& invocation, const std::string& axis) : invocation_(invocation), axis_(axis) {}
  std::string of(const std::string& text) {
    const auto address = parse_address(text);
    if (!address) return text;
    if (!catalogue_) catalogue_ = catalogue_of(invocation_, axis_);
    for (const auto& parameter : catalogue_->parameters())
      if (parameter.address() == *address) return parameter.name();
    throw Failure(ExitCode::usage,
                  fmt::format("{}: {} has no parameter at {}", axis_, catalogue_->model(), text));
  }

 private:
  Invocation& invocation_;
  const std::string& axis_;
  std::optional<v1::ListParametersResponse> catalogue_;
};

/// What a pattern that fits nothing was probably meant for: a name, or one of its words.
std::string meant_by(std::string_view pattern, const v1::ListParametersResponse& catalogue) {
  std::vector<std::string_view> words;
  for (const auto& parameter : catalogue.parameters()) {
    words.emplace_back(parameter.name());
    for (const auto word : std::views::split(std::string_view(parameter.name()), '_'))
      words.emplace_back(word);
  }
  const auto near = config::nearest(pattern, words);
  return near.empty() ? "without a pattern all are listed" : fmt::format("did you mean '{}'?", near);
}

void parameters(Invocation& invocation, const Arguments& arguments) {
  auto catalogue = catalogue_of(invocation, arguments.axis);
  v1::ReadParametersRequest request;
  request.set_axis(arguments.axis);
  v1::ListParametersResponse shown;
  shown.set_model(catalogue.model());
  for (auto& parameter : *catalogue.mutable_parameters()) {
    if (!fits(parameter.name(), arguments.pattern)) continue;
    if (parameter.access() != v1::PARAMETER_ACCESS_WRITE_ONLY) request.add_names(parameter.name());
    *shown.add_parameters() = std::move(parameter);
  }
  if (shown.parameters().empty())
    throw Failure(ExitCode::usage,
                  fmt::format("{}: no parameter of {} fits '{}'; {}", arguments.axis, shown.model(),
                              arguments.pattern, meant_by(arguments.pattern, catalogue)));
  v1::ReadParametersResponse values;
  if (arguments.read && !request.names().empty())
    values = invocation.client().call(&Stub::ReadParameters, request, arguments.axis);
  if (invocation.json) {
    auto text = json(shown);
    if (arguments.read) text = text.substr(0, text.size() - 1) + "," + json(values).substr(1);
    return print_line(text);
  }
  parameter_table(shown, values.values(), {.values = arguments.read, .descriptions = arguments.describe})
      .print(use_colour());
}

void show(Invocation& invocation, const std::string& axis, const google::protobuf::Message& message,
          const google::protobuf::RepeatedPtrField<v1::ParameterValue>& values) {
  if (invocation.json) return print_line(json(message));
  value_table(catalogue_of(invocation, axis), values).print(use_colour());
}

void read(Invocation& invocation, const Arguments& arguments) {
  v1::ReadParametersRequest request;
  request.set_axis(arguments.axis);
  Names names(invocation, arguments.axis);
  for (const auto& name : arguments.names) request.add_names(names.of(name));
  const auto response = invocation.client().call(&Stub::ReadParameters, request, arguments.axis);
  show(invocation, arguments.axis, response, response.values());
}

void write(Invocation& invocation, const Arguments& arguments) {
  v1::WriteParametersRequest request;
  request.set_axis(arguments.axis);
  request.set_lease_token(arguments.lease_token);
  Names names(invocation, arguments.axis);
  for (const auto& text : arguments.names) {
    auto& value = *request.add_values() = parse_assignment(text);
    value.set_name(names.of(value.name()));
  }
  const auto response = invocation.client().call(&Stub::WriteParameters, request, arguments.axis);
  show(invocation, arguments.axis, response, response.values());
}

}  // namespace

void add_parameter_commands(CLI::App& drive, Invocation& invocation) {
  const auto add = [&](const char* name, const char* help, void (*action)(Invocation&, const Arguments&)) {
    auto* command = drive.add_subcommand(name, help);
    const auto arguments = std::make_shared<Arguments>();
    command->add_option("AXIS", arguments->axis, "Name of the axis")->required();
    command->callback([&invocation, arguments, action] { action(invocation, *arguments); });
    return std::pair(command, arguments);
  };
  const auto [list_command, listed] =
      add("parameters", "The model's parameters: range, default, access, and who decides them", parameters);
  list_command->add_option("PATTERN", listed->pattern, "Part of the names, or a pattern: speed, '*_delay'");
  list_command->add_flag("--read", listed->read, "With the values that the drive holds");
  list_command->add_flag("--describe", listed->describe, "With what they mean");

  const auto [read_command, wanted] = add("read", "What the drive holds", read);
  read_command->add_option("NAME", wanted->names,
                           "Names or addresses (6041h:00, 0x0010); none: all that can be read");

  const auto [write_command, written] = add(
      "write", "Write parameters, all or none, and read them back; at standstill, power stage off", write);
  write_command->add_option("NAME=VALUE", written->names, "Decimal or hexadecimal: current=6, 2006h:00=0x8")
      ->required();
  add_lease(*write_command, written->lease_token);
  write_command->footer("\nExample: axisctl drive write feeder lock_current=1 current=0x6");
}

}  // namespace axisd::axisctl
