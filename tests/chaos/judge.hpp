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
#include "tests/chaos/journey.hpp"
#include "tests/chaos/plant.hpp"
#include "tests/chaos/telegram.hpp"

namespace axisd::chaos {

/// The rules, each checked at the moment it could be broken:
///  - a command ends exactly once, and in an order that exists
///  - one trigger per command at most (homing: one to back off, one to home), within its life, after all that
///    were accepted before it have ended, and never between the request of a stop and the stop's frame, nor
///    while StopAll holds. On CAN a frame counts from when it is handed over. A word that waits for a SYNC is
///    part of its trigger, and so is that SYNC, and each later one until the drive had one.
///  - a start of a drive belongs to a trigger of ours, or to a terminal that somebody actuated; the power
///    stage is switched on by an Enable only
///  - a start takes the shaft, from where it really is, as far or to where it was asked to (journey.hpp),
///    whatever becomes of it later
///  - Done is no lie: the load is where the command says, has moved as far as it says, and rests. What a
///    terminal began, or let go of, while the drive was read excuses it, and a hand that brought the load to
///    its target. Not executed means that nothing
///    started; everything else has a cause
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
        positions = 0, marks = 0, departures = 0, distances = 0, by_terminal = 0, by_sync = 0;
  };
  [[nodiscard]] const Tally& tally() const { return tally_; }

 private:
  struct Judged {
    CommandPtr command;
    CommandState last = CommandState::accepted;
    int ends = 0, moves = 0, homings = 0;  ///< triggers
    int starts = 0;
    std::optional<Stretch> departed{};  ///< where the shaft was at its last start, pulses
    std::uint64_t stop_frames = 0;      ///< that the drive had executed when this was accepted
    TimePoint accepted_at{};
  };
  using JudgedPtr = std::shared_ptr<Judged>;
  /// What waits in a drive for a SYNC: `told` from when the frame was handed over, `withdrawn` where it was
  /// taken back behind a SYNC that is on its way.
  enum class Armed : std::uint8_t { no, told, released, withdrawn };
  struct Subject {
    std::deque<JudgedPtr> motions;  ///< that may start something, in the order of their acceptance
    JudgedPtr triggered;            ///< whose trigger was on the wire last
    bool stop_owed = false;         ///< asked for, and no frame of it on the wire yet
    Armed armed = Armed::no;
    TimePoint last_executed{};
    std::vector<std::uint8_t> last_frame;
    std::uint64_t stop_frames = 0;         ///< executed by the drive
    std::uint64_t stop_frames_at_ask = 0;  ///< when the newest stop was asked for
    std::optional<std::int64_t> origin;    ///< the shaft at position 0, pulses, while it is known
    TimePoint own_start{};                 ///< a terminal started it last
    Stretch own_start_from{};              ///< from there
    TimePoint turned{};                    ///< by hand, last
  };

  void on_bind(Station& station, const Telegram& telegram);
  void on_sync(Station& station, Subject& subject);
  void on_trigger(Station& station, Subject& subject, bool homing);
  void check_stops(Station& station, const Subject& subject);
  void check_enable(Station& station);
  void on_executed(Station& station, const Executed& executed);
  void on_own_start(Station& station);
  void on_departure(Station& station, const Subject& subject, const Executed& executed);
  void on_change(const JudgedPtr& judged, const Command& command);
  void on_end(Station& station, Subject& subject, const Judged& judged, const Command& command);
  void check_arrival(Station& station, const Subject& subject, const Judged& judged, const Command& command);
  void on_done(Station& station, Subject& subject, const Judged& judged, const Command& command);
  [[nodiscard]] static double position(const Station& station, const Subject& subject);
  [[nodiscard]] static bool trusted(const Station& station);
  [[nodiscard]] static JudgedPtr due(Subject& subject);

  Plant* plant_;
  bool inhibited_ = false;
  std::map<std::string, Subject> subjects_;
  std::map<CommandRecord*, JudgedPtr> judged_;
  std::vector<std::string> violations_;
  std::deque<std::string> history_;
  Tally tally_;
};

}  // namespace axisd::chaos
