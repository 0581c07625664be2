// command list|get|watch|cancel: accepted commands as resources.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <string>

#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/repetition.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/command_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;
using Stub = v1::CommandService::Stub;

void show(const Invocation& invocation, const v1::Command& command) {
  print_line(invocation.json ? json(command) : command_line(command, ""));
}

void watch(Invocation& invocation, const std::string& id) {
  v1::WatchCommandRequest request;
  request.set_id(id);
  grpc::ClientContext context;
  const Interrupt interrupt([&context] { context.TryCancel(); });
  auto stream = invocation.client().stream(context, &Stub::WatchCommand, request);
  v1::WatchCommandResponse change;
  while (!ended(change.command()) && stream.read(change)) show(invocation, change.command());
  if (ended(change.command())) context.TryCancel();
  const auto status = stream.finish();
  if (ended(change.command())) {
    invocation.status = outcome(change.command());
    return;
  }
  if (interrupt.requested()) {
    invocation.status = ExitCode::interrupted;
    return;
  }
  if (status.ok()) throw Failure(ExitCode::unreachable, id + ": the daemon ended the stream");
  throw invocation.client().failure(status, id);
}

void get(Invocation& invocation, const std::string& id) {
  v1::GetCommandRequest request;
  request.set_id(id);
  show(invocation, invocation.client().call(&Stub::GetCommand, request, id).command());
}

void cancel(Invocation& invocation, const std::string& id) {
  v1::CancelCommandRequest request;
  request.set_id(id);
  const auto& client = invocation.client();
  show(invocation, repeat_stop(client, &Stub::CancelCommand, request, id, client.timeout()).command());
}

std::string clock_text(const google::protobuf::Timestamp& at) {
  return TimeUtil::ToString(TimeUtil::MillisecondsToTimestamp(TimeUtil::TimestampToMilliseconds(at)));
}

/// Where it goes, how far, or how fast.
std::string target_of(const v1::Command& command) {
  const auto& asked = command.asked();
  if (asked.has_position()) return fmt::format("{:g}", asked.position());
  if (asked.has_distance()) return fmt::format("{:+g}", asked.distance());
  return asked.has_velocity() ? fmt::format("{:g}/s", asked.velocity()) : "";
}

void list(Invocation& invocation, const std::string& axis, std::uint32_t limit) {
  v1::ListCommandsRequest request;
  request.set_axis(axis);
  request.set_limit(limit);
  const auto response = invocation.client().call(&Stub::ListCommands, request, axis);
  if (invocation.json) return print_line(json(response));
  Table table({"ACCEPTED", "AXIS", "COMMAND", "TARGET", "STATE", "TOOK", "CLIENT", "ID", "CAUSE"}, {3, 5});
  for (const auto& command : response.commands())
    table.add(
        {clock_text(command.accepted_at()), command.axis(),
         camel_word(v1::CommandKind_Name(command.kind()), "COMMAND_KIND_"), target_of(command),
         command_state(command),
         command.has_ended_at() ? duration_text(seconds(command.ended_at() - command.accepted_at())) : "",
         command.client(), command.id(),
         command.has_cause() ? describe(command.cause(), command.axis()) : ""});
  table.print(use_colour());
}

void add_list(CLI::App& group, Invocation& invocation) {
  auto* command = group.add_subcommand(
      "list", "The newest commands of all clients since the daemon was started, newest first");
  const auto axis = std::make_shared<std::string>();
  const auto limit = std::make_shared<std::uint32_t>(20);
  command->add_option("AXIS", *axis, "Only those of this axis");
  command->add_option("-n,--limit", *limit, "At most so many")->check(CLI::Range(1, 500));
  command->callback([&invocation, axis, limit] { list(invocation, *axis, *limit); });
}

}  // namespace

void add_command_commands(CLI::App& app, Invocation& invocation) {
  auto* group = app.add_subcommand("command", "Commands that were accepted: list, get, watch, cancel");
  group->require_subcommand(1);
  const auto add = [&](const char* name, const char* help, void (*action)(Invocation&, const std::string&)) {
    auto* command = group->add_subcommand(name, help);
    const auto id = std::make_shared<std::string>();
    command->add_option("ID", *id, "The command's id, as printed when it was accepted")->required();
    command->callback([&invocation, id, action] { action(invocation, *id); });
  };
  add_list(*group, invocation);
  add("get", "How a command stands", get);
  add("watch", "A line per change until the command has ended; status 0 only for Done", watch);
  add("cancel", "Halt the axis if it executes this command", cancel);
}

}  // namespace axisd::axisctl
