#pragma once

#include <functional>
#include <string>
#include <vector>

#include "buses/error.hpp"
#include "devices/bus_watch.hpp"

namespace axisd::store {

/// Where flight records are kept. Thread: core; callbacks arrive there, too.
class RecordFiles {
 public:
  /// Makes the text of a record; called on a thread of its own.
  using Render = std::function<std::string()>;
  virtual ~RecordFiles() = default;

  /// Keeps a record under `name`; the oldest one goes where there are too many. Errors: storage.
  virtual void write(std::string name, Render render, std::function<void(Result<void>)> done) = 0;
  /// Oldest first. Errors: storage.
  virtual void list(std::function<void(Result<std::vector<FlightRecord>>)> done) = 0;
  /// Errors: invalid_argument (there is none of that name), storage.
  virtual void read(std::string name, std::function<void(Result<std::string>)> done) = 0;
};

/// The first lines of a record: where it comes from. What is in them is read back by describe().
std::string record_head(const std::string& bus, const std::string& reason, TimePoint monotonic,
                        WallTime wall);
/// Bus and reason, as record_head() wrote them.
void describe(std::string_view text, FlightRecord& record);
/// "line-a-20261121T134455.123Z.wire": names sort by time for each bus.
std::string record_name(const std::string& bus, WallTime wall);

}  // namespace axisd::store
