#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/task.hpp"

namespace axisd::core {

/// Speaks to axisd-link, the privileged program that takes CAN links down and up (M26), over its unix socket:
/// a connection per request, one line each way. Never blocks. Thread: core.
class LinkClient {
 public:
  /// Longest that an answer is awaited. Setting some interfaces up takes a while (slcan: several replies of
  /// the adapter).
  static constexpr Duration patience = std::chrono::seconds(5);
  using Done = std::function<void(Result<void>)>;

  /// `clock` outlives it.
  LinkClient(Executor executor, Clock& clock, std::string socket_path);
  ~LinkClient();
  LinkClient(const LinkClient&) = delete;

  /// Takes the interface down and up. Calls back exactly once, never from within this call, and not once
  /// this is gone. Errors: there is no helper, it refuses, the kernel refused it.
  void cycle(const std::string& interface, Done done);
  /// Asks whether it would, and changes nothing: a machine without a helper should say so at its start, not
  /// after its first bus-off.
  void check(const std::string& interface, Done done);

 private:
  class Request;
  void ask(std::string line, Done done);

  Executor executor_;
  Clock* clock_;
  std::string path_;
  std::vector<std::shared_ptr<Request>> requests_;
};

}  // namespace axisd::core
