#include "api/axisctl/progress.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <thread>

#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/repetition.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/command_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

constexpr int paint_period_ms = 100;
constexpr std::string_view erase_line = "\r\x1b[K";

/// Paints the progress line from the axis's state, on a thread of its own, until it is destroyed.
class Painter {
 public:
  Painter(const Client& client, v1::Command command, std::optional<double> start)
      : command_(std::move(command)), start_(start), thread_([this, &client] { run(client); }) {}
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;
  ~Painter() {
    context_.TryCancel();
    thread_.join();
    if (painted_) print(erase_line);
  }

  void update(const v1::Command& command) {
    const std::lock_guard lock(mutex_);
    command_ = command;
  }

 private:
  void run(const Client& client) {
    v1::WatchAxesRequest request;
    request.add_axes(command_.axis());
    request.mutable_period()->set_nanos(paint_period_ms * 1'000'000);
    auto stream = client.stream(context_, &v1::AxisService::Stub::WatchAxes, request);
    for (v1::WatchAxesResponse batch; stream.read(batch);)
      if (batch.axes_size() == 1) paint(batch.axes(0));
    // Progress is a comfort: what became of the command is told by its own stream.
    stream.finish();
  }
  void paint(const v1::AxisState& state) {
    const std::lock_guard lock(mutex_);
    std::string text = progress_text(state, command_, start_);
    text.resize(std::min(text.size(), static_cast<std::size_t>(std::max(1, terminal_columns() - 1))));
    print(fmt::format("{}{}", erase_line, text));
    painted_ = true;
  }

  std::mutex mutex_;
  v1::Command command_;
  std::optional<double> start_;
  bool painted_ = false;
  grpc::ClientContext context_;
  std::thread thread_;
};

ExitCode interrupted(Invocation& invocation, const v1::Command& command, const Follow& options) {
  if (invocation.in_script) return ExitCode::interrupted;
  if (options.halt_on_interrupt) {
    const auto halt = halt_axis(invocation, command.axis(), invocation.client().timeout());
    print_line(invocation.json ? json(halt) : command_line(halt, options.unit));
    return ExitCode::interrupted;
  }
  throw Failure(
      ExitCode::interrupted,
      fmt::format("{}: interrupted; command {} goes on; 'axisctl halt {}' ends it, 'axisctl command watch "
                  "{}' follows it",
                  command.axis(), command.id(), command.axis(), command.id()));
}

}  // namespace

v1::Command halt_axis(Invocation& invocation, const std::string& axis, std::chrono::nanoseconds limit) {
  v1::HaltRequest request;
  request.set_axis(axis);
  request.mutable_options()->set_request_id(random_uuid());
  return repeat_stop(invocation.client(), &v1::AxisService::Stub::Halt, request, axis, limit).command();
}

std::optional<double> percent_of_way(std::optional<double> start, std::optional<double> target,
                                     double position) {
  if (!start || !target || *start == *target) return std::nullopt;
  return std::clamp(100 * (position - *start) / (*target - *start), 0.0, 100.0);
}

std::optional<double> target_of(const v1::Command& command, std::optional<double> start) {
  if (command.granted().has_position()) return command.granted().position();
  if (command.asked().has_position()) return command.asked().position();
  if (command.kind() != v1::COMMAND_KIND_MOVE_RELATIVE || !start) return std::nullopt;
  if (command.granted().has_distance()) return *start + command.granted().distance();
  if (command.asked().has_distance()) return *start + command.asked().distance();
  return std::nullopt;
}

std::string progress_text(const v1::AxisState& state, const v1::Command& command,
                          std::optional<double> start) {
  std::string text = fmt::format("{}  {}  {}", state.axis(), with_unit(state.position(), state.unit()),
                                 with_unit(state.velocity(), state.unit() + "/s"));
  if (const auto percent = percent_of_way(start, target_of(command, start), state.position())) {
    constexpr int bar = 20;
    const int full = static_cast<int>(*percent * bar / 100);
    text += fmt::format("  [{:#<{}}{: <{}}]  {:.0f} %", "", full, "", bar - full, *percent);
  } else {
    text += "  " + state_text(state);
  }
  // Both times are the daemon's, so a client's clock that is wrong does not show.
  if (state.has_measured_at() && command.has_accepted_at())
    text += fmt::format("  {:.1f} s",
                        std::max(0.0, seconds(state.measured_at() + state.age() - command.accepted_at())));
  return text;
}

ExitCode outcome(const v1::Command& command) {
  return ended(command) && command.state() != v1::COMMAND_STATE_DONE ? ExitCode::ended_otherwise
                                                                     : ExitCode::ok;
}

namespace {

/// `latest`: the command as it was seen last; where it has ended, nothing of it is printed yet.
ExitCode follow_to_end(Invocation& invocation, const v1::Command& command, const Follow& options,
                       v1::Command& latest) {
  latest = command;
  grpc::Status status;
  {
    grpc::ClientContext context;
    const Interrupt interrupt([&context] { context.TryCancel(); });
    std::optional<Painter> painter;
    if (!invocation.json && !ended(command) && is_terminal(STDOUT_FILENO))
      painter.emplace(invocation.client(), command, options.start);
    v1::WatchCommandRequest request;
    request.set_id(command.id());
    if (!ended(latest)) {
      auto stream = invocation.client().stream(context, &v1::CommandService::Stub::WatchCommand, request);
      for (v1::WatchCommandResponse change; !ended(latest) && stream.read(change);) {
        latest = change.command();
        if (painter) painter->update(latest);
      }
      // The stream's end is no news once the command has ended.
      if (ended(latest)) context.TryCancel();
      status = stream.finish();
    }
    painter.reset();
    if (!ended(latest) && interrupt.requested()) return interrupted(invocation, latest, options);
  }
  if (!ended(latest)) {
    const auto failure = status.ok() ? Failure(ExitCode::unreachable,
                                               fmt::format("{}: the daemon ended the stream", command.axis()))
                                     : invocation.client().failure(status, command.axis());
    throw failure.saying(fmt::format("{}; command {} may go on: 'axisctl command watch {}' follows it",
                                     failure.what(), command.id(), command.id()));
  }
  return outcome(latest);
}

/// One object for all of them.
ExitCode report_as_json(Invocation& invocation, const std::vector<v1::Command>& commands, bool wait,
                        const Follow& options) {
  v1::ListCommandsResponse all;
  for (const auto& command : commands) *all.add_commands() = command;
  ExitCode result = ExitCode::ok;
  try {
    for (auto& latest : *all.mutable_commands()) {
      const auto command = latest;
      const ExitCode one = wait ? follow_to_end(invocation, command, options, latest) : outcome(command);
      if (result == ExitCode::ok) result = one;
    }
  } catch (const Failure&) {
    print_line(json(all));
    throw;
  }
  print_line(json(all));
  return result;
}

}  // namespace

ExitCode follow(Invocation& invocation, const v1::Command& command, const Follow& options) {
  v1::Command latest;
  const auto result = follow_to_end(invocation, command, options, latest);
  if (ended(latest)) print_line(invocation.json ? json(latest) : command_line(latest, options.unit));
  return result;
}

ExitCode report(Invocation& invocation, const std::vector<v1::Command>& commands, bool wait,
                const Follow& options) {
  if (invocation.json && options.several) return report_as_json(invocation, commands, wait, options);
  ExitCode result = ExitCode::ok;
  for (const auto& command : commands)
    // JSON is one object per command: with --wait that is the ended one.
    if (!wait || (!invocation.json && !ended(command)))
      print_line(invocation.json ? json(command) : command_line(command, options.unit));
  for (const auto& command : commands) {
    const ExitCode one = wait ? follow(invocation, command, options) : outcome(command);
    if (result == ExitCode::ok) result = one;
  }
  return result;
}

}  // namespace axisd::axisctl
