// Whether one machine's axisd answers. Pure: time and answers come in, what to ask goes out.
//
//   unknown ---answer---> answering        unknown ---late, failed-> silent
//   answering -late-----> late             (the connection stands, a question was not answered in time)
//   answering -lost, moved-> lost          (the connection has ended, or is another one; asked again at once)
//   answering -failed---> lost             (asked again soon)
//   late ------answer---> answering        late ------late, failed-> silent
//   lost ------answer---> answering        lost ------late, failed-> silent
//   late ------lost, moved-> lost
//   silent ----answer---> answering
//   any -------an answer of another machine-> silent, with the trouble
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "buses/clock.hpp"

namespace axisd::cell {

/// What a machine says of itself.
struct PeerAnswer {
  std::string machine;      ///< its name
  std::string instance_id;  ///< of this run of its axisd
  std::string version;
  bool inhibited = false;  ///< StopAll holds it
  Duration round_trip{};
};

/// Thread: core.
class PeerMachine {
 public:
  enum class State : std::uint8_t { unknown, answering, late, lost, silent };
  struct Times {
    Duration pause = std::chrono::seconds(1);  ///< between two questions
    Duration again =
        std::chrono::milliseconds(100);  ///< after one that failed, before it is said to be silent
  };
  /// What to do.
  enum class Effect : std::uint8_t {
    none,
    ask,       ///< on the connection that there is
    ask_anew,  ///< on another connection: what this one leads to is not known any more
  };

  PeerMachine(std::string name, Times times, TimePoint now)
      : name_(std::move(name)), times_(times), due_(now) {}

  /// To be called at due(), or later.
  [[nodiscard]] Effect time(TimePoint now);
  void answered(TimePoint now, PeerAnswer answer);
  /// The question had no answer in time, on a connection that stands.
  void late(TimePoint now, std::string why);
  /// The question failed: there is no connection, or it is refused there.
  void failed(TimePoint now, std::string why);
  /// The connection has ended.
  void connection_lost(TimePoint now);
  /// The addresses are others than before.
  void moved(TimePoint now);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] TimePoint due() const { return due_; }
  [[nodiscard]] bool answers() const {
    return state_ == State::answering || state_ == State::late || state_ == State::lost;
  }
  /// It is known whom the connection leads to: calls may go there.
  [[nodiscard]] bool is_open() const { return state_ == State::answering || state_ == State::late; }
  /// The last one; nothing: none yet.
  [[nodiscard]] const std::optional<PeerAnswer>& last() const { return last_; }
  /// Why it is silent, for people.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  void be_silent(TimePoint now, std::string why);

  const std::string name_;
  const Times times_;
  State state_ = State::unknown;
  /// When to ask next; TimePoint::max(): a question is under way.
  TimePoint due_;
  bool anew_ = false;  ///< what is asked next goes over another connection
  std::optional<PeerAnswer> last_;
  std::string trouble_;
};

}  // namespace axisd::cell
