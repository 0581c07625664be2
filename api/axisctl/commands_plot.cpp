// plot: a motion as a picture.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include "api/axisctl/duration.hpp"
#include "api/axisctl/follow.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/plot.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

constexpr double before_motion = 0.1, after_motion = 0.3;  // s, shown beside the motion

struct PlotArguments {
  std::string axis, output, period = "10ms";
};

/// Homing pauses between its parts, and a motion is one from its acceptance on.
bool is_motion(v1::State state) {
  return state == v1::STATE_HOMING || state == v1::STATE_DISCRETE_MOTION ||
         state == v1::STATE_CONTINUOUS_MOTION || state == v1::STATE_SYNCHRONIZED_MOTION;
}

/// Collects samples from shortly before a motion until the axis rests.
class Recording {
 public:
  /// Returns false once the motion is over.
  bool take(const v1::AxisState& state) {
    if (!state.has_measured_at()) return true;
    const double time =
        static_cast<double>(google::protobuf::util::TimeUtil::TimestampToMilliseconds(state.measured_at())) /
        1e3;
    const bool moves = state.moving() || is_motion(state.state());
    if (plot_.samples.empty() || time > plot_.samples.back().time) {
      plot_.samples.push_back(
          {.time = time,
           .position = state.position(),
           .velocity = state.velocity(),
           .target = state.has_target() && moves ? std::optional(state.target()) : std::nullopt});
      if (moves) moved_at_ = time;
    }
    plot_.unit = state.unit();
    if (!moved_at_)
      std::erase_if(plot_.samples, [&](const auto& one) { return one.time < time - before_motion; });
    return !moved_at_ || time < *moved_at_ + after_motion;
  }

  [[nodiscard]] bool moved() const { return moved_at_.has_value(); }

  /// What was recorded, with times from 0 on.
  [[nodiscard]] Plot plot(const std::string& axis) const {
    Plot plot = plot_;
    const double begin = plot.samples.front().time;
    double fastest = 0;
    for (auto& sample : plot.samples) {
      sample.time -= begin;
      fastest = std::max(fastest, std::abs(sample.velocity));
    }
    const auto start = google::protobuf::util::TimeUtil::MillisecondsToTimestamp(std::llround(begin * 1e3));
    plot.title = axis;
    plot.subtitle =
        fmt::format("{}: from {} to {}, at most {}", google::protobuf::util::TimeUtil::ToString(start),
                    with_unit(plot.samples.front().position, plot.unit),
                    with_unit(plot.samples.back().position, plot.unit), with_unit(fastest, plot.unit + "/s"));
    return plot;
  }

 private:
  Plot plot_;
  std::optional<double> moved_at_;  ///< last sample in motion
};

/// Before anything is recorded: a motion cannot be had a second time. Leaves no file behind.
void check_writable(const std::string& path) {
  if (path == "-") return;
  const bool existed = std::filesystem::exists(path);
  if (!std::ofstream(path, std::ios::binary | std::ios::app))
    throw Failure(ExitCode::usage, fmt::format("cannot write '{}': give another --output", path));
  if (!existed) std::filesystem::remove(path);
}

void write(const std::string& path, const std::string& text) {
  if (path == "-") return print(text);
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Failure(ExitCode::usage, fmt::format("cannot write '{}'", path));
}

void plot(Invocation& invocation, const PlotArguments& arguments) {
  const auto path = arguments.output.empty() ? as_file_name(arguments.axis) + ".svg" : arguments.output;
  check_writable(path);
  v1::WatchAxesRequest request;
  request.add_axes(arguments.axis);
  set(*request.mutable_period(), parse_duration(arguments.period, "--period"));
  Recording recording;
  follow<v1::WatchAxesResponse>(
      invocation.client(), &v1::AxisService::Stub::WatchAxes, request, arguments.axis,
      [&](const v1::WatchAxesResponse& batch) { return recording.take(batch.axes(0)); });
  if (!recording.moved())
    throw Failure(ExitCode::interrupted,
                  fmt::format("{}: it did not move; nothing was written", arguments.axis));
  const auto result = recording.plot(arguments.axis);
  write(path, svg(result));
  if (path != "-")
    print_line(fmt::format("{}: {} samples within {}", path, result.samples.size(),
                           duration_text(result.samples.back().time)));
}

}  // namespace

void add_plot_command(CLI::App& app, Invocation& invocation) {
  auto* command = app.add_subcommand(
      "plot", "Record the next motion of an axis, or the present one, and draw position and velocity as SVG");
  const auto arguments = std::make_shared<PlotArguments>();
  command->add_option("AXIS", arguments->axis, "Name of the axis")->required();
  command->add_option("--output", arguments->output, "The picture; -: standard output (default: AXIS.svg)")
      ->type_name("FILE");
  command
      ->add_option("--period", arguments->period,
                   "Time between samples, 10ms to 60s; the drive may answer less often")
      ->type_name("TIME")
      ->capture_default_str();
  command->footer(
      "\nEnds when the axis rests again, or with Ctrl-C. Example:\n"
      "  axisctl plot feeder & axisctl move feeder 120mm --wait; wait");
  command->callback([&invocation, arguments] { plot(invocation, *arguments); });
}

}  // namespace axisd::axisctl
