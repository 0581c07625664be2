// A client that asks for anything at any time, by a seed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/chaos/judge.hpp"
#include "tests/chaos/plant.hpp"

namespace axisd::chaos {

/// Moves, jogs, homes, stops, resets, repeats requests and reads registers, each a while after the last one,
/// until it rests. What the machine refuses is refused; what it accepts the judge gets to see.
class Client {
 public:
  Client(Plant& plant, Judge& judge, std::string name, std::uint64_t seed);
  Client(const Client&) = delete;
  /// Asks for nothing more; what it has begun goes on.
  void rest() { next_.reset(); }

 private:
  void wait();
  void act();
  void stop(Station& station);
  void stop_all();
  void move_group();
  void coordinate();
  void read_marks(const Station& station);
  void submit(const Station& station, const Action& action);
  void repeat();
  [[nodiscard]] Action motion(const Station& station);
  [[nodiscard]] Action sensible(const Station& station);

  struct Submitted {
    std::string axis;
    Action action;
    CommandOptions options;
    CommandPtr command;
  };

  Plant* plant_;
  Judge* judge_;
  std::string name_;
  Dice dice_;
  std::optional<Submitted> last_;
  std::weak_ptr<GroupRun> prepared_;  ///< the last; not over a restart of the daemon
  int requests_ = 0;
  Clock::Timer next_;
  std::vector<Clock::Timer> later_;
};

}  // namespace axisd::chaos
