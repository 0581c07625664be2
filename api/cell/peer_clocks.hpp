// How far the clocks of the other machines' computers are from this one's.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "api/cell/clock_samples.hpp"
#include "buses/clock.hpp"

namespace axisd::cell {

/// As their entrances tell. A computer that was started anew has another clock, so that nothing is kept of
/// one whose entrance does not answer, or is another run. Pure. Thread: core.
class PeerClocks {
 public:
  struct Reading {
    std::string instance_id;   ///< of the entrance that has read it
    TimePoint sent, received;  ///< question and answer, by this computer's clock
    Duration clock;
  };

  void answered(const std::string& machine, const Reading& reading) {
    auto& peer = peers_[machine];
    if (peer.instance_id != reading.instance_id) peer = {.instance_id = reading.instance_id};
    peer.samples.add(reading.sent, reading.received, reading.clock);
  }
  void failed(const std::string& machine) { peers_.erase(machine); }
  void forget_if(const std::function<bool(const std::string& machine)>& unknown) {
    std::erase_if(peers_, [&](const auto& peer) { return unknown(peer.first); });
  }
  /// Nothing: it is not known.
  [[nodiscard]] std::optional<ClockSamples::Offset> of(const std::string& machine, TimePoint now) const {
    const auto found = peers_.find(machine);
    return found == peers_.end() ? std::nullopt : found->second.samples.at(now);
  }

 private:
  struct Peer {
    std::string instance_id{};
    ClockSamples samples{};
  };
  std::map<std::string, Peer> peers_;
};

}  // namespace axisd::cell
