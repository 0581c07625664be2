// Compares what was asked, what went over the wires and what the drives did.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "devices/axis/command_book.hpp"
#include "tests/chaos/plant.hpp"

namespace axisd::chaos {

/// The rules, each checked at the moment it could be broken:
///  - a command ends exactly once, and in an order that exists
///  - one trigger per command at most (homing: one to back off, one to home), within its life, and never
///    between the request of a stop and the stop's frame, nor while StopAll holds
///  - a start of a drive belongs to a trigger of ours; the power stage is switched on by an Enable only
///  - Done is no lie: the load is where the command says, and rests; not executed means that nothing started
///  - a confirmed stop reached the drive after it was asked for, and the load rests
///  - a trusted position of a resting axis is where the load is
class Judge {
 public:
  explicit Judge(Plant& plant);
  ~Judge();
  Judge(const Judge&) = delete;

  /// From now on nothing may start before a stop's frame: the gate was raised, or the stop submitted.
  void stop_asked(const std::string& axis);
  void inhibited(bool is) { inhibited_ = is; }
  void accepted(const CommandPtr& command);
  /// Looks at the positions that the axes show.
  void look();
  void check_marks(const Station& station, int offset, const std::vector<std::uint16_t>& read);
  /// With the faults gone and StopAll confirmed: everything has ended, and each stop arrived.
  void conclude();

  void violation(const std::string& axis, std::string_view what);
  [[nodiscard]] const std::vector<std::string>& violations() const { return violations_; }
  /// The last things that happened, for failure messages.
  [[nodiscard]] std::string history() const;
  void note(const std::string& axis, std::string_view what);

  struct Tally {
    int commands = 0, done = 0, aborted = 0, failed = 0, unknown = 0, not_executed = 0, starts = 0, stops = 0,
        positions = 0, marks = 0;
  };
  [[nodiscard]] const Tally& tally() const { return tally_; }

 private:
  struct Judged {
    CommandPtr command;
    CommandState last = CommandState::accepted;
    int ends = 0, moves = 0, homings = 0;  ///< triggers
    int starts = 0;
    std::uint64_t stop_frames = 0;  ///< that the drive had executed when this was accepted
  };
  using JudgedPtr = std::shared_ptr<Judged>;
  struct Subject {
    JudgedPtr motion;        ///< the newest that may start something
    JudgedPtr triggered;     ///< whose trigger was on the wire last
    bool stop_owed = false;  ///< asked for, and no frame of it on the wire yet
    TimePoint stop_asked{}, last_executed{};
    std::vector<std::uint8_t> last_frame;
    std::uint64_t stop_frames = 0;         ///< executed by the drive
    std::uint64_t stop_frames_at_ask = 0;  ///< when the newest stop was asked for
    std::optional<double> origin;          ///< load position of 0, mm, while it is known
  };

  void on_bind(Station& station, const test::WireEntry& entry);
  void on_trigger(Station& station, Subject& subject, bool homing);
  void on_executed(Station& station, const Executed& executed);
  void on_change(const JudgedPtr& judged, const Command& command);
  void on_end(Station& station, Subject& subject, const Judged& judged, const Command& command);
  void on_done(Station& station, Subject& subject, const Judged& judged, const Command& command);
  [[nodiscard]] static double load(const Station& station);

  Plant* plant_;
  bool inhibited_ = false;
  std::map<std::string, Subject> subjects_;
  std::map<CommandRecord*, JudgedPtr> judged_;
  std::vector<std::string> violations_;
  std::deque<std::string> history_;
  Tally tally_;
};

}  // namespace axisd::chaos
