#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/core/fair_lane.hpp"
#include "devices/axis/command_book.hpp"
#include "devices/event.hpp"

namespace axisd::core {

/// The newest commands of this run of the daemon, fairly between clients, and their events. Thread: core.
class CommandLog {
 public:
  using Tell = std::function<void(const std::string& axis, EventContent)>;
  static constexpr std::size_t capacity = 4'000;

  explicit CommandLog(Tell tell) : tell_(std::move(tell)) {}

  /// A command was accepted: tells of that, and of its end.
  void add(const CommandPtr& command);
  /// Tells of the end of a command of an earlier run of the daemon, which may have come already.
  void follow(const CommandPtr& command);
  /// As they stand now, newest first, at most `most`; of one axis unless that is empty.
  [[nodiscard]] std::vector<Command> newest(const std::string& axis, std::size_t most) const;

 private:
  void tell(const Command& now);

  Tell tell_;
  FairLane lane_{capacity};
  std::uint64_t last_ = 0;
  std::map<std::uint64_t, CommandPtr> commands_;
  std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace axisd::core
