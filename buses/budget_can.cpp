// What the messages of a network mean for axes, on the response times of CAN (budget.md).
#include "buses/budget_can.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "buses/can/response_time.hpp"
#include "buses/canopen/cob.hpp"
#include "buses/canopen/sdo_client.hpp"

namespace axisd::canopen {
namespace {

using can::Stream;

constexpr Duration longest_bound = std::chrono::seconds(600);
/// Least time between two EMCY of one node, and between two heartbeats. 1015h is optional, and rarely there.
constexpr Duration emergency_period = std::chrono::milliseconds(100),
                   heartbeat_period = std::chrono::milliseconds(250);
constexpr std::uint32_t full_speed = 1'000'000;
constexpr int sdo_bytes = 8, command_bytes = 2;
/// A stop cuts another transfer of its node so long after that one's last frame.
constexpr Duration cut_after = SdoSettings{}.turnaround;

double rate(Duration period) { return 1.0 / std::chrono::duration<double>(period).count(); }

Duration sum_of(Duration a, Duration b) {
  return a == Duration::max() || b == Duration::max() || a + b > longest_bound ? Duration::max() : a + b;
}
Duration times(std::int64_t count, Duration one) {
  return one == Duration::max() && count > 0 ? one : count * (count > 0 ? one : Duration{});
}

class Analysis {
 public:
  explicit Analysis(const NetworkDemand& demand);
  [[nodiscard]] LoadBudget load(int moving) const;
  [[nodiscard]] StopBudget stop(const AxisDemand& last, int axes) const;
  [[nodiscard]] AxisBudget axis(const AxisDemand& axis) const;

 private:
  [[nodiscard]] std::int64_t nodes() const { return std::ssize(demand_.axes) + std::ssize(demand_.devices); }
  [[nodiscard]] int count() const { return static_cast<int>(demand_.axes.size()); }
  [[nodiscard]] Duration time_of(int bytes) const { return can::frame_time(bytes, demand_.network.bitrate); }
  [[nodiscard]] bool by_pdo(const AxisDemand& axis) const {
    return !demand_.by_sdo && axis.set.state_pdo_count() > 0;
  }
  [[nodiscard]] bool synchronous() const { return demand_.network.sync_period > Duration{}; }
  /// Least and greatest time between two of its TPDOs.
  [[nodiscard]] Duration shortest_period(const AxisDemand& axis) const {
    return synchronous() ? demand_.network.sync_period : scaled(axis.set.pdo_inhibit);
  }
  [[nodiscard]] Duration longest_period(const AxisDemand& axis) const {
    return synchronous() ? demand_.network.sync_period : scaled(axis.set.pdo_event);
  }
  [[nodiscard]] Duration scaled(Duration period) const {
    return period * (full_speed / std::clamp<std::uint32_t>(demand_.network.bitrate, 10'000, full_speed));
  }
  void add_streams();
  /// From the hand-over of one of axisd's frames to its end, behind a full window and `before` others.
  [[nodiscard]] Duration sent(int bytes, std::int64_t before, int before_bytes) const;
  /// A reply of any node, from when it is ready.
  [[nodiscard]] Duration replied() const;
  /// One SDO transfer, with requests to so many other nodes before it.
  [[nodiscard]] Duration transfer(std::int64_t others) const {
    return transfers_.at(static_cast<std::size_t>(others));
  }
  [[nodiscard]] Duration reading(const AxisDemand& axis) const;
  [[nodiscard]] Duration refresh(const AxisDemand& axis, Duration poll, int drift) const;
  [[nodiscard]] double utilisation(int moving) const;

  const NetworkDemand& demand_;
  std::vector<Stream> streams_;  ///< of the nodes that may win against an SDO request
  Duration replied_{};
  std::vector<Duration> transfers_;  ///< by how many others there are
};

Analysis::Analysis(const NetworkDemand& demand) : demand_(demand) {
  add_streams();
  replied_ = replied();
  for (std::int64_t others = 0; others < nodes(); ++others)
    transfers_.push_back(
        sum_of(sum_of(sent(sdo_bytes, others, sdo_bytes), demand_.network.sdo_timeout), replied_));
}

/// SDO replies answer requests, of which each node has one under way at most; the next one goes out behind.
void Analysis::add_streams() {
  const auto reply = time_of(sdo_bytes);
  for (const auto& axis : demand_.axes) {
    streams_.push_back({.id = emergency_id(axis.node), .transmission = reply, .period = emergency_period});
    streams_.push_back({.id = sdo_reply_id(axis.node), .transmission = reply, .period = Duration::max()});
    if (!by_pdo(axis)) continue;
    // A drive answers a SYNC when it comes to it.
    const auto period = shortest_period(axis);
    for (unsigned i = 0; i < axis.set.state_pdos.size(); ++i)
      if (const auto bytes = axis.set.state_pdos.at(i); bytes > 0)
        streams_.push_back({.id = tpdo_id(i + 1, axis.node),
                            .transmission = time_of(bytes),
                            .period = period,
                            .jitter = period / 2});
  }
  for (const auto& device : demand_.devices) {
    streams_.push_back({.id = emergency_id(device.node), .transmission = reply, .period = emergency_period});
    streams_.push_back({.id = sdo_reply_id(device.node), .transmission = reply, .period = Duration::max()});
  }
}

Duration Analysis::sent(int bytes, std::int64_t before, int before_bytes) const {
  // A SYNC, and for each node a request or what ends it. Their replies are among the streams.
  const auto window = std::min(static_cast<std::int64_t>(demand_.window), 2 * nodes() + 1);
  const auto ahead = window * time_of(sdo_bytes) + before * time_of(before_bytes);
  return can::queue_response_time(streams_, ahead, time_of(bytes), time_of(sdo_bytes),
                                  demand_.network.bitrate, longest_bound)
      .value_or(Duration::max());
}

Duration Analysis::replied() const {
  // The least urgent reply, behind axisd's own frames with lower identifiers: SYNC, NMT and stops of all.
  const auto ahead = time_of(0) + nodes() * (time_of(command_bytes) + time_of(command_bytes));
  return can::queue_response_time(streams_, ahead, Duration{}, time_of(sdo_bytes), demand_.network.bitrate,
                                  longest_bound)
      .value_or(Duration::max());
}

/// From when it is asked for: by PDO after the next SYNC, or when the node sends next.
Duration Analysis::reading(const AxisDemand& axis) const {
  if (!by_pdo(axis)) return times(axis.set.state_transfers, transfer(nodes() - 1));
  const auto period = longest_period(axis);
  const auto last = sum_of(2 * period, period / 2);  // it may be late by one
  return sum_of(sum_of(last, sent(0, nodes(), sdo_bytes)), replied_);
}

Duration Analysis::refresh(const AxisDemand& axis, Duration poll, int drift) const {
  const auto transfers = axis.set.continuity_transfers + drift;
  return sum_of(sum_of(poll, times(transfers, transfer(nodes() - 1))), reading(axis));
}

double Analysis::utilisation(int moving) const {
  const auto share = [](Duration transmission, Duration period) {
    return std::chrono::duration<double>(transmission).count() * rate(period);
  };
  const auto both_ways = 2 * time_of(sdo_bytes);
  double sum = 0;
  if (synchronous()) sum += share(time_of(0), demand_.network.sync_period);
  int left = moving;
  for (const auto& axis : demand_.axes) {
    const bool moves = left-- > 0;
    sum += share(time_of(1), heartbeat_period);
    sum += share(axis.set.continuity_transfers * both_ways, axis.continuity_period);
    if (!moves) sum += share(axis.set.drift_transfers * both_ways, axis.drift_check);
    if (by_pdo(axis)) {
      for (const auto bytes : axis.set.state_pdos)
        if (bytes > 0) sum += share(time_of(bytes), shortest_period(axis));
    } else {
      sum += share(axis.set.state_transfers * both_ways, moves ? axis.poll_moving : axis.poll_idle);
    }
  }
  for (const auto& device : demand_.devices) sum += share(device.transfers * both_ways, device.poll);
  return sum;
}

LoadBudget Analysis::load(int moving) const {
  LoadBudget load{.moving = moving, .utilisation = utilisation(moving)};
  load.utilisation_max = load.utilisation;
  for (const auto& axis : demand_.axes) {
    if (moving > 0) load.refresh_moving = std::max(load.refresh_moving, refresh(axis, axis.poll_moving, 0));
    if (moving < count())
      load.refresh_idle =
          std::max(load.refresh_idle, refresh(axis, axis.poll_idle, axis.set.drift_transfers));
  }
  return load;
}

/// By RPDO its frame goes at once, and what confirms it follows by SDO. Without, the frame is the last of the
/// transfers, and one that is under way there is cut first.
StopBudget Analysis::stop(const AxisDemand& last, int axes) const {
  const auto others = std::int64_t{axes} - 1;
  const auto acknowledged = times(last.set.stop_transfers, transfer(others));
  StopBudget stop{.axes = axes};
  const auto by_sdo = sum_of(cut_after, sum_of(times(last.set.stop_transfers - 1, transfer(others)),
                                               sent(sdo_bytes, others, sdo_bytes)));
  const auto frame = by_pdo(last) ? sent(command_bytes, others, command_bytes) : by_sdo;
  stop.last_frame = sum_of(demand_.network.budget.host_allowance, frame);
  stop.standstill = sum_of(sum_of(stop.last_frame, sum_of(cut_after, acknowledged)),
                           sum_of(refresh(last, last.poll_moving, 0), reading(last)));
  return stop;
}

AxisBudget Analysis::axis(const AxisDemand& axis) const {
  return {.axis = axis.name,
          .refresh_idle = refresh(axis, axis.poll_idle, axis.set.drift_transfers),
          .refresh_moving = refresh(axis, axis.poll_moving, 0),
          .refresh_moving_all = refresh(axis, axis.poll_moving, 0),
          .alone = stop(axis, 1),
          .all = stop(axis, count())};
}

/// Whether a drive takes its PDOs is only known when it was asked.
std::string note_on_polling(NetworkDemand demand) {
  demand.by_sdo = true;
  const auto polled = budget_of(demand);
  return fmt::format(
      "with drives that refuse their PDOs: utilisation {:.2f}, last stop frame of all axes {}, refresh while "
      "all move {}",
      polled.load.back().utilisation, within_text(polled.stops.back().last_frame),
      within_text(polled.load.back().refresh_moving));
}

}  // namespace

BusBudget budget_of(const NetworkDemand& demand) {
  const Analysis analysis(demand);
  BusBudget budget{.bus = demand.network.name};
  const auto count = static_cast<int>(demand.axes.size());
  for (int moving = 0; moving <= count; ++moving) budget.load.push_back(analysis.load(moving));
  for (int axes = 1; axes <= count; ++axes) {
    StopBudget worst{.axes = axes};
    for (const auto& axis : demand.axes) {
      const auto stop = analysis.stop(axis, axes);
      worst.last_frame = std::max(worst.last_frame, stop.last_frame);
      worst.standstill = std::max(worst.standstill, stop.standstill);
    }
    budget.stops.push_back(worst);
  }
  for (const auto& axis : demand.axes) budget.axes.push_back(analysis.axis(axis));
  if (!demand.by_sdo && count > 0) budget.notes.push_back(note_on_polling(demand));
  return budget;
}

}  // namespace axisd::canopen
