// People at the machine, who know nothing of the daemon, by a seed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/chaos/plant.hpp"

namespace axisd::chaos {

/// Turn shafts that give way, a little or far, and actuate terminals that start motion or release the motor,
/// all of it also between two readings of the daemon's.
class Hands {
 public:
  Hands(Plant& plant, std::uint64_t seed);
  Hands(const Hands&) = delete;
  /// Takes the hands off everything.
  void rest();

 private:
  void wait();
  void act();
  void push(Station& station);
  void actuate(Station& station);
  void set(Station& station, const char* terminal, bool active);
  void tell(const Station& station, const std::string& what);

  Plant* plant_;
  Dice dice_;
  Clock::Timer next_;
  std::vector<Clock::Timer> later_;
};

}  // namespace axisd::chaos
