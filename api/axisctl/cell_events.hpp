// What happened in a cell: at its machines, and to the cell itself.
#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <string>
#include <vector>

#include "api/axisctl/invocation.hpp"
#include "axisd/v1/event_service.pb.h"

namespace axisd::axisctl {

struct CellEventQuery {
  std::vector<std::string> words;    ///< as Selection takes them
  v1::WatchEventsRequest machines;   ///< kinds, and after_sequence 0 unless only what is new is wanted
  google::protobuf::Timestamp from;  ///< earlier ones are not shown
  bool of_machines = true;           ///< events of machines
  bool of_cell = true;               ///< events of the cell
  bool follow = false;
};

/// Prints them in the order of their times, each machine's by its own clock; those that come while it follows
/// as they come. Throws Failure.
void cell_events(Invocation& invocation, const CellEventQuery& query);

}  // namespace axisd::axisctl
