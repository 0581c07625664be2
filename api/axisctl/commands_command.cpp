// command get|watch|cancel: accepted commands as resources.
#include <CLI/CLI.hpp>
#include <memory>

#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/progress.hpp"
#include "api/axisctl/repetition.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/command_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::CommandService::Stub;

void show(const Invocation& invocation, const v1::Command& command) {
  print_line(invocation.json ? json(command) : command_line(command, ""));
}

void watch(Invocation& invocation, const std::string& id) {
  v1::WatchCommandRequest request;
  request.set_id(id);
  grpc::ClientContext context;
  const Interrupt interrupt([&context] { context.TryCancel(); });
  Stub stub(invocation.client().channel());
  const auto stream = stub.WatchCommand(&context, request);
  v1::WatchCommandResponse change;
  while (!ended(change.command()) && stream->Read(&change)) show(invocation, change.command());
  if (ended(change.command())) context.TryCancel();
  const auto status = stream->Finish();
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

}  // namespace

void add_command_commands(CLI::App& app, Invocation& invocation) {
  auto* group = app.add_subcommand("command", "Commands that were accepted: get, watch, cancel");
  group->require_subcommand(1);
  const auto add = [&](const char* name, const char* help, void (*action)(Invocation&, const std::string&)) {
    auto* command = group->add_subcommand(name, help);
    const auto id = std::make_shared<std::string>();
    command->add_option("ID", *id, "The command's id, as printed when it was accepted")->required();
    command->callback([&invocation, id, action] { action(invocation, *id); });
  };
  add("get", "How a command stands", get);
  add("watch", "A line per change until the command has ended; status 0 only for Done", watch);
  add("cancel", "Halt the axis if it executes this command", cancel);
}

}  // namespace axisd::axisctl
