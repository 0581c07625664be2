#include "tests/chaos/hands.hpp"

#include <fmt/format.h>

namespace axisd::chaos {

using namespace std::chrono_literals;

namespace {

/// What a terminal started ends within this of its release: the longest are a homing over the whole travel
/// at 20 mm/s and a jog at the slowest velocity of a motion before it.
constexpr auto longest_by_homing = 40s, longest_else = 2s;

}  // namespace

Hands::Hands(Plant& plant, std::uint64_t seed) : plant_(&plant), dice_(seed) { wait(); }

void Hands::rest() {
  next_.reset();
  later_.clear();
  for (auto& station : plant_->stations)
    if (station.wired != Wired::nothing) set(station, "X3", false);
}

void Hands::wait() {
  next_ = plant_->world.clock().call_at(plant_->world.now() + dice_.up_to(600ms), [this] {
    act();
    wait();
  });
}

void Hands::act() {
  auto& station =
      plant_->stations.at(static_cast<std::size_t>(dice_.pick(static_cast<int>(plant_->stations.size()))));
  if (station.wired == Wired::nothing || dice_.chance(0.6)) return push(station);
  actuate(station);
}

/// Nothing happens where the drive holds the shaft.
void Hands::push(Station& station) {
  plant_->settle();
  const int span = dice_.chance(0.3) ? 5 : dice_.chance(0.5) ? 300 : 4000;
  const auto pulses = dice_.pick(2 * span + 1) - span;
  if (station.drive->drive().push_shaft(pulses)) tell(station, fmt::format("is turned by {}", pulses));
}

void Hands::tell(const Station& station, const std::string& what) {
  if (plant_->on_hand) plant_->on_hand(station, what);
}

void Hands::set(Station& station, const char* terminal, bool active) {
  plant_->settle();
  tell(station, fmt::format("terminal {} {}", terminal, active ? "on" : "off"));
  station.drive->drive().set_input(terminal, active);
}

void Hands::actuate(Station& station) {
  const auto now = plant_->world.now();
  const auto held = dice_.chance(0.5) ? 12ms + dice_.up_to(60ms) : dice_.up_to(500ms);
  const auto longest = station.wired == Wired::homing ? Duration(longest_by_homing) : Duration(longest_else);
  if (station.wired == Wired::free)
    station.released_until = now + 30ms + held;
  else
    station.actuated_until = now + held + longest;
  if (station.wired == Wired::segment) set(station, "X4", true);
  const auto later = [&](Duration after, auto what) {
    later_.push_back(plant_->world.clock().call_at(now + after, what));
  };
  // The pins have to stand for 5 ms, and terminals have filters.
  later(30ms, [this, &station] { set(station, "X3", true); });
  if (station.wired == Wired::free) later(30ms + held / 2, [this, &station] { push(station); });
  later(30ms + held, [this, &station] { set(station, "X3", false); });
}

}  // namespace axisd::chaos
