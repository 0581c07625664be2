// How many calls are open: of each caller, and of all.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>

namespace axisd::cell {

/// No caller takes the places of all others. Stops are not counted among the others' calls, and have a share
/// of their own that nobody meets but a program gone wild. Thread: any.
class OpenCalls {
 public:
  struct Limits {
    int all = 4096, each = 256;
    int stops_each = 1024;
  };
  explicit OpenCalls(Limits limits) : limits_(limits) {}

  enum class Kind : std::uint8_t { counted, stop };
  /// False: it has no place, and takes none.
  [[nodiscard]] bool enter(const std::string& caller, Kind kind);
  void leave(const std::string& caller, Kind kind);
  /// That are open now, stops included.
  [[nodiscard]] int open() const;

 private:
  struct Share {
    int counted = 0, stops = 0;
  };
  const Limits limits_;
  mutable std::mutex mutex_;
  std::unordered_map<std::string, Share> shares_;  ///< under mutex_, as the rest
  int counted_ = 0, stops_ = 0;
};

}  // namespace axisd::cell
