// The metrics of an entrance.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/cell/clock_samples.hpp"
#include "api/cell/group_moves.hpp"
#include "api/cell/routes.hpp"
#include "api/exposition/exposition.hpp"
#include "api/tls/expiry.hpp"
#include "axisd/cell/v1/cell_service.pb.h"
#include "buses/clock.hpp"
#include "buses/latency_histogram.hpp"

namespace axisd::cell {

/// What there is to tell at one moment.
struct Reading {
  struct MachineReading {
    std::string name;
    v1::MachineState state;
    std::optional<Duration> round_trip;
    bool stop_all;
    std::optional<ClockSamples::Offset> clock{};  ///< of its computer
  };
  /// How many machines began to answer, and ceased to.
  struct Lives {
    std::uint64_t births = 0, deaths = 0;
  };
  std::string cell, machine;
  v1::RegistryState registry{};
  std::optional<Duration> registry_age;  ///< since etcd was last heard of
  std::vector<MachineReading> machines;
  std::map<std::string, std::shared_ptr<RouteTally>> tallies;
  Lives lives;
  std::uint64_t told_again = 0, refused = 0, too_many = 0;
  std::size_t stops_standing = 0;
  bool durable = true;
  int open_calls = 0;
  int open_moves = 0;
  GroupMoves::Tally moves;  ///< of several machines
  LatencyHistogram durations;
  std::vector<tls::Expiry> certificates;
};

/// As Prometheus reads it. Labels have names of machines and constants of this program. Pure.
[[nodiscard]] std::string render(const Reading& reading, metrics::Format format);

}  // namespace axisd::cell
