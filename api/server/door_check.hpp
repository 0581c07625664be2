// Whether the daemon still answers: asked as its clients ask.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "api/transport/knock.hpp"
#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::server {

/// Asks at both doors: a GroupStop that names nothing, through the stop lane down to the core and back, and
/// GetInfo through the main server. Each has a connection of its own, which is there from the start: whoever
/// keeps others from connecting must not be able to have the daemon taken for dead. That others can connect
/// at all is tried apart from that, at each port (Knock). Thread: one at a time.
class DoorCheck {
 public:
  /// As Server::connect_inside() and StopLane::connect_inside(): a new connection.
  using Connect = std::function<FileDescriptor()>;

  /// `knocks`: of all addresses.
  DoorCheck(Connect main_server, Connect stop_lane, std::vector<std::shared_ptr<transport::Knock>> knocks);
  /// Waits a moment for questions that are on their way, which are cancelled.
  ~DoorCheck();
  DoorCheck(const DoorCheck&) = delete;

  /// Asks at each door that owes no answer. Never waits.
  void ask();
  /// The doors that have owed an answer since before `when`, by name. A refusal is an answer.
  [[nodiscard]] std::vector<std::string> silent_since(TimePoint when) const;

 private:
  class Door;
  std::vector<std::shared_ptr<Door>> doors_;
  std::vector<std::shared_ptr<transport::Knock>> knocks_;
};

}  // namespace axisd::server
