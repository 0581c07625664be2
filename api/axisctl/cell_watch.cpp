// list, state and watch across the machines of a cell.
#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "api/axisctl/across.hpp"
#include "api/axisctl/cell_commands.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/live_view.hpp"
#include "api/axisctl/machine_streams.hpp"
#include "api/axisctl/state_view.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Axes = std::vector<Answer<v1::ListAxesResponse>>;

/// Of what was selected, in the order of machines; a single axis is found in its machine's list.
Axes axes_of_cell(Invocation& invocation, const Selection& selection) {
  const auto& client = invocation.client();
  const auto known = machines_of_cell(invocation);
  auto answers = ask_machines(client, selected(known, selection), &v1::AxisService::Stub::ListAxes,
                              v1::ListAxesRequest(), client.timeout());
  tell_left_out(known, selection);
  for (auto& answer : answers) {
    const auto wanted = selection.axes_of(answer.machine);
    if (!answer.response || wanted.empty()) continue;
    v1::ListAxesResponse found;
    for (const auto& name : wanted) {
      bool there = false;
      for (const auto& state : answer.response->axes())
        if (state.axis() == name) *found.add_axes() = state, there = true;
      if (!there)
        throw Failure(ExitCode::refused,
                      fmt::format("{}: no such axis; 'axisctl list {}' shows those of the machine", name,
                                  answer.machine));
    }
    answer.response = std::move(found);
  }
  return answers;
}

/// What is shown while machines send. Thread: any.
class Screen {
 public:
  Screen(const Invocation& invocation, const v1::WatchAxesRequest& request, std::uint64_t count)
      : json_(invocation.json),
        fields_(request.fields().paths().begin(), request.fields().paths().end()),
        left_(count),
        counted_(count > 0) {
    if (json_ || !is_terminal(STDOUT_FILENO)) return;
    live_.emplace();
    painter_ = std::jthread([this](const std::stop_token& stop) { paint(stop); });
  }

  /// False: that was the last one.
  bool take(const std::string& machine, const v1::WatchAxesResponse& batch) {
    const std::lock_guard lock(mutex_);
    if (counted_ && left_ == 0) return false;
    if (live_) {
      newest_[machine] = batch;
      changed_ = true;
    } else {
      print_line(json_ ? (fields_.empty() ? json(batch) : field_json(batch, fields_))
                       : (fields_.empty() ? tick_line(batch) : field_line(batch, fields_)));
    }
    return !counted_ || --left_ > 0;
  }

  void tell(const std::string& machine, const std::optional<Failure>& trouble) {
    const std::lock_guard lock(mutex_);
    if (!live_) {
      if (trouble) complain(*trouble, json_);
      return;
    }
    newest_.erase(machine);
    troubles_.erase(machine);
    if (trouble) troubles_[machine] = trouble->what();
    changed_ = true;
  }

 private:
  void paint(const std::stop_token& stop) {
    constexpr std::chrono::milliseconds period(100);
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      again_.wait_for(lock, stop, period, [] { return false; });
      if (std::exchange(changed_, false)) live_->show(lines());
    }
  }
  [[nodiscard]] std::vector<std::string> lines() const {
    google::protobuf::RepeatedPtrField<v1::AxisState> axes;
    for (const auto& [machine, batch] : newest_) axes.MergeFrom(batch.axes());
    const auto table = fields_.empty() ? axis_table(axes) : field_table(axes, fields_);
    auto lines = table.lines(use_colour(), terminal_columns());
    for (const auto& [machine, text] : troubles_) lines.push_back(coloured(text, Colour::red, use_colour()));
    return lines;
  }

  const bool json_;
  const std::vector<std::string> fields_;
  std::uint64_t left_;
  const bool counted_;
  std::optional<LiveView> live_;
  std::mutex mutex_;
  std::condition_variable_any again_;
  bool changed_ = false;
  std::map<std::string, v1::WatchAxesResponse> newest_;
  std::map<std::string, std::string> troubles_;
  std::jthread painter_;
};

}  // namespace

void list_cell(Invocation& invocation, const std::vector<std::string>& words, bool names) {
  const auto answers = axes_of_cell(invocation, Selection(words));
  v1::ListAxesResponse all;
  for (const auto& answer : answers)
    if (answer.response) all.MergeFrom(*answer.response);
  if (names) {
    for (const auto& state : all.axes()) print_line(state.axis());
  } else if (invocation.json) {
    print_line(json(all));
  } else {
    axis_table(all.axes()).print(use_colour());
  }
  tell_failures(invocation, answers);
}

void show_cell_axes(Invocation& invocation, const std::vector<std::string>& words) {
  const auto answers = axes_of_cell(invocation, Selection(words));
  bool first = true;
  for (const auto& answer : answers) {
    if (!answer.response) continue;
    for (const auto& state : answer.response->axes()) {
      if (!invocation.json && !std::exchange(first, false)) print_line("");
      print(invocation.json ? json(state) + "\n" : state_details(state, use_colour()));
    }
  }
  tell_failures(invocation, answers);
}

void show_kept_states(Invocation& invocation, void (*show)(const v1::GetStateResponse&)) {
  const auto& client = invocation.client();
  const auto known = machines_of_cell(invocation);
  const Selection everything({});
  const auto answers = ask_machines(client, selected(known, everything), &v1::SystemService::Stub::GetState,
                                    v1::GetStateRequest(), client.timeout());
  tell_left_out(known, everything);
  for (const auto& answer : answers) {
    if (!answer.response) continue;
    if (!invocation.json) {
      print_line(fmt::format("{}{}:", &answer == &answers.front() ? "" : "\n", answer.machine));
      show(*answer.response);
      continue;
    }
    google::protobuf::Struct line;
    if (!google::protobuf::util::JsonStringToMessage(json(*answer.response), &line).ok()) continue;
    (*line.mutable_fields())["machine"].set_string_value(answer.machine);
    print_line(json(line));
  }
  tell_failures(invocation, answers);
}

void watch_cell(Invocation& invocation, const std::vector<std::string>& words,
                const v1::WatchAxesRequest& request, std::uint64_t count) {
  const Selection selection(words);
  Screen screen(invocation, request, count);
  MachineStreams* streams = nullptr;
  MachineStreams all(
      invocation, selection,
      [&](const Client& machine, grpc::ClientContext& context, const std::string& name) {
        auto wanted = request;
        for (const auto& axis : selection.axes_of(name)) wanted.add_axes(axis);
        auto stream = machine.stream(context, &v1::AxisService::Stub::WatchAxes, wanted);
        for (v1::WatchAxesResponse batch; stream.read(batch);) {
          streams->flows(name);
          if (!screen.take(name, batch)) streams->end();
        }
        const auto status = stream.finish();
        return status.ok()
                   ? Failure(ExitCode::unreachable, fmt::format("{}: the daemon ended the stream", name))
                   : machine.failure(status, name);
      },
      [&screen](const std::string& name, const std::optional<Failure>& trouble) {
        screen.tell(name, trouble);
      });
  streams = &all;
  all.run();
}

}  // namespace axisd::axisctl
