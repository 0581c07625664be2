// What both kinds of wire have alike.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "daemon/sim/options.hpp"
#include "devices/simulation/drive_option.hpp"

namespace axisd::sim {

/// Serves the drives until a signal asks for the end. Precondition: no thread was started. Exit status.
int serve_rtu(const Options& options);
int serve_can(const Options& options);

/// Says what is wrong; exit status 2.
int complain(const Error& error);
/// Tells whoever waits for it that `where` can be used.
void say_ready(const std::string& where);

/// One line per frame, written at once, so that a reader sees the wire as it is.
class FrameLog {
 public:
  /// An empty path: nothing is written. Errors: the file cannot be written.
  static Result<FrameLog> open(const std::string& path);
  explicit operator bool() const { return file_ != nullptr; }
  /// `begin`: of the frame. `received`: from a client. Thread: one.
  void write(TimePoint begin, bool received, std::string_view frame) const {
    fmt::print(file_.get(), "{} {} {}\n", begin.time_since_epoch().count(), received ? "rx" : "tx", frame);
  }

 private:
  FrameLog() : file_(nullptr, &std::fclose) {}
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

/// Makes each drive by `make(model, settings)`. Errors: there is none; a drive that cannot be made.
template <class Node>
Result<std::vector<std::unique_ptr<Node>>> make_nodes(
    const Options& options,
    Result<std::unique_ptr<Node>> (*make)(std::string_view, simulation::SimulatedNodeSettings)) {
  if (options.drives.empty())
    return fail(Reason::invalid_argument, "there is no drive", "give --drive or --node with --model");
  std::vector<std::unique_ptr<Node>> nodes;
  for (const auto& text : options.drives) {
    auto option = simulation::parse_drive(text);
    if (!option) return fail(option.error());
    auto node = make(option->model, std::move(option->settings));
    if (!node) return fail(node.error());
    nodes.push_back(std::move(*node));
  }
  return nodes;
}

}  // namespace axisd::sim
