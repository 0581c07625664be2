#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "buses/error.hpp"

namespace axisd::cell {

/// Writes files on a thread of its own: the core never waits for the disk. Thread: core, that of `core`.
class Disk {
 public:
  using Done = std::function<void(const Result<void>&)>;

  explicit Disk(boost::asio::any_io_executor core) : core_(std::move(core)) {}
  /// What was begun is written to its end.
  ~Disk() { thread_.join(); }
  Disk(const Disk&) = delete;

  /// The newest content wins: what waits for an earlier write of the same file is written with it, and told
  /// of then.
  void write(const std::string& path, std::string content, Done done);
  /// Anything else that blocks; then `done`, on the core.
  void run(std::function<void()> work, std::function<void()> done);

 private:
  struct Waiting {
    bool under_way = false;
    std::optional<std::string> content;  ///< to be written next
    std::vector<Done> told_next;
  };
  void begin(const std::string& path);

  boost::asio::any_io_executor core_;
  std::map<std::string, Waiting> files_;
  boost::asio::thread_pool thread_{1};
};

}  // namespace axisd::cell
