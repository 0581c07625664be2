// Names of the computer's users.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "buses/clock.hpp"

namespace axisd::server {

/// Remembers for a while what each user is called: whoever connects again and again does not make the daemon
/// read a file each time. Thread: any; two may look the same user up at once, and none waits for another.
class UserNames {
 public:
  using LookUp = std::function<std::string(uid_t user)>;
  /// After that a user is looked up again.
  static constexpr Duration longest = std::chrono::seconds(10);
  /// Users that are remembered.
  static constexpr std::size_t most = 64;

  explicit UserNames(LookUp look_up) : look_up_(std::move(look_up)) {}
  [[nodiscard]] std::string of(uid_t user, TimePoint now);

 private:
  struct Known {
    std::string name;
    TimePoint since{};
  };

  const LookUp look_up_;
  std::mutex mutex_;
  std::map<uid_t, Known> known_;  ///< under mutex_
};

}  // namespace axisd::server
