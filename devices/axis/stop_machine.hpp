// Stopping an axis: the frame, its confirmation, its escalation, what is owed and who holds (M4, M12 to M14).
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/gate.hpp"
#include "devices/axis/command_record.hpp"
#include "devices/axis/standstill.hpp"
#include "devices/axis/stop_holds.hpp"
#include "devices/axis/unseen_start.hpp"

namespace axisd {

/// Knows whether a stop is coming to an axis, and decides what follows each step of it. It sends nothing and
/// waits for nothing: a sequence does what it says. One sequence serves all stops that arrive meanwhile, and
/// each of them gets a frame of its own. Thread: core.
///
/// What is under way (State):
///
///   none       -- begin() -----------------------------------------> sending
///   sending    -- sent(): no reply, for the first or second time --> sending
///   sending    -- sent(): out of reach, but another was asked for -> sending
///   sending    -- sent(): any other reply, or silent so often -----> confirming
///   confirming -- looked(): another was asked for -----------------> sending
///   confirming -- looked(): moves, and no stop may have arrived ---> sending
///   confirming -- looked(): rests, but never acknowledged ---------> sending, three times
///   confirming -- looked(): moves, not yet told to stop quickly ---> sending, a quick stop
///   confirming -- looked(): moves, and the release is permitted ---> releasing
///   releasing  -- next_attempt() ----------------------------------> sending
///   any        -- confirmed(), failed() ---------------------------> none
///
/// What may move without a live command, until it was seen at rest (Debt):
///
///   none           -- leave_running() --> motion
///   none           -- owe() ------------> stop
///   motion         -- owe() ------------> stop_of_motion
///   stop           -- leave_running() --> stop_of_motion
///   motion         -- restarted() ------> none
///   stop_of_motion -- restarted() ------> stop
///   any            -- failed() ---------> as owe()
///   any            -- confirmed() -----> none
///   any            -- pay() -----------> none
///   any            -- seen_at_rest() ---> none, unless a stop is under way
class StopMachine {
 public:
  enum class State : std::uint8_t {
    none,
    sending,     ///< a frame is with the drive, or is to be
    confirming,  ///< standstill is looked for
    releasing,   ///< the power stage is being released, as nothing else has stopped it
  };
  enum class Debt : std::uint8_t {
    none,
    motion,          ///< a command has ended, and what it began may go on
    stop,            ///< a stop, to a drive that was not seen at rest (M4)
    stop_of_motion,  ///< both
  };
  /// What became of a stop frame.
  enum class Answer : std::uint8_t {
    acknowledged,
    refused,
    no_reply,
    failed,  ///< it was not sent, or nobody can say
  };
  /// What the sequence has to do next.
  enum class Step : std::uint8_t {
    send,           ///< next_attempt()
    look,           ///< for standstill, within patience()
    quicken,        ///< send: the ramp did not bring it to rest in time
    release,        ///< the power stage, then send
    rests,          ///< confirmed()
    unreachable,    ///< failed(): the frame was not acknowledged
    fell_silent,    ///< failed(): before its standstill was confirmed
    not_confirmed,  ///< failed(): it moves, whatever was done
  };

  /// `holds`: of the axis; may be null. Both outlive this.
  StopMachine(const AxisGate& gate, const StopHolds* holds) : gate_(&gate), holds_(holds) {}

  // Events
  /// The stop that follows finds the axis in motion.
  void found_in_motion() { of_motion_ = true; }
  /// Another stop, which needs a frame. begin() follows in the same handler.
  void ask(StopKind kind);
  /// A command that ends with the stop. Returns one that ends now, as newer ones of its client have taken its
  /// place; nullptr: none does.
  [[nodiscard]] CommandPtr serve(CommandPtr command);
  /// True: a sequence has to be launched. False: the running one sends this one, too.
  [[nodiscard]] bool begin();
  /// The kind of the frame to be sent now.
  StopKind next_attempt();
  /// `offline`: nobody is connected to the drive.
  Step sent(Answer answer, bool offline);
  /// `found`: undecided where it moves, no stop was acknowledged, and patience() is not over yet.
  /// `may_release`: the configuration permits it (stop_escalation).
  Step looked(RestVerdict found, bool offline, bool may_release);
  /// The sequence has ended; its commands, which end with it.
  std::vector<CommandPtr> confirmed();
  std::vector<CommandPtr> failed();

  /// How long it brakes: by the deceleration that it was told last (7.6.2), or by a fixed one of its own.
  void set_deceleration(Duration time) { deceleration_ = time; }
  void leave_running();
  void owe();
  /// Its standstill was confirmed, by whoever looked.
  void pay() { debt_ = Debt::none; }
  /// The drive was restarted: nothing of ours goes on.
  void restarted();
  /// By a reading of a drive that is online.
  void seen_at_rest();
  /// A stop, a disable or a cancel arrived then at the server.
  void arrived(TimePoint at) { arrived_ = std::max(arrived_, at); }

  /// The newest start, until a reading shows it: before that rest is no standstill.
  [[nodiscard]] UnseenStart& unseen_start() { return unseen_start_; }
  [[nodiscard]] const UnseenStart& unseen_start() const { return unseen_start_; }

  /// What of it the axis shows (M14).
  enum class Shown : std::uint8_t {
    nothing,
    ended_motion,  ///< a halt, until the motion that it ends has ended
    stopping,      ///< a stop, or somebody holds one
  };

  // What is coming
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] Debt debt() const { return debt_; }
  [[nodiscard]] bool under_way() const { return state_ != State::none; }
  [[nodiscard]] bool owed() const { return debt_ >= Debt::stop; }
  /// What a command began, and has ended, may go on.
  [[nodiscard]] bool left_running() const { return debt_ == Debt::motion || debt_ == Debt::stop_of_motion; }
  /// Under way, or asked for and not seen by the core yet.
  [[nodiscard]] bool coming() const { return under_way() || gate_->stop_pending(); }
  /// Under way, and not only a halt: no motion may take its place (M14).
  [[nodiscard]] bool stops() const { return under_way() && kind_ > StopKind::halt; }
  /// A stop that forbids motion until it has ended by itself.
  [[nodiscard]] bool forbids_motion() const { return stops() || gate_->stop_pending(); }
  /// Somebody keeps the axis in Stopping.
  [[nodiscard]] bool held() const { return holds_ != nullptr && !holds_->empty(); }
  [[nodiscard]] Shown shown() const {
    if (held() || stops()) return Shown::stopping;
    return under_way() && of_motion_ ? Shown::ended_motion : Shown::nothing;
  }
  /// A request that arrived then is older than a stop. Not set: it is the daemon's own.
  [[nodiscard]] bool overtook(TimePoint request) const {
    return request != TimePoint{} && request < arrived_;
  }
  /// Another stop was asked for since the attempt that is under way.
  [[nodiscard]] bool overtaken() const { return requests_ != attempt_.requests; }
  /// From a stop frame to the standstill, at most.
  [[nodiscard]] Duration deceleration() const { return deceleration_; }
  /// `quick`: how long it brakes in a quick stop.
  [[nodiscard]] Duration patience(Duration margin, Duration quick) const {
    return margin + (attempt_.kind == StopKind::quick_stop ? quick : deceleration_);
  }
  /// Rises with each stop that failed.
  [[nodiscard]] std::uint64_t failures() const { return failures_; }
  /// The newest that a client asked for; nullptr: there was none.
  [[nodiscard]] const CommandPtr& last() const { return last_; }

  /// A stop without a reply is repeated at once, this often before the motor's state decides.
  static constexpr int attempts = 3;
  /// A drive at rest that has acknowledged no stop gets further attempts, so many rounds in all: that it
  /// rests does not tell that a stop has arrived. After the last round it is one that does not acknowledge.
  static constexpr int unacknowledged_rounds = 4;
  /// Commands of one client that wait for the standstill: whoever stops the axis all the time keeps it from
  /// being confirmed, and must not fill the memory with that.
  static constexpr int most_of_one_client = 256;

 private:
  struct Attempt {
    StopKind kind = StopKind::none;
    int requests = 0;
    Answer answer = Answer::acknowledged;
  };
  std::vector<CommandPtr> end();
  Step go_to(State state, Step step);

  const AxisGate* gate_;
  const StopHolds* holds_;
  State state_ = State::none;
  Debt debt_ = Debt::none;
  StopKind kind_ = StopKind::none;  ///< strongest requested
  int requests_ = 0;                ///< each needs a frame of its own
  Attempt attempt_;                 ///< the last
  int silent_ = 0;                  ///< replies in a row that did not come
  int rounds_ = 0;                  ///< of attempts without any reply
  bool released_ = false;           ///< the last resort was tried
  bool of_motion_ = false;          ///< the first of them found the axis in motion
  std::deque<CommandPtr> commands_;
  std::map<std::string, int> served_;  ///< of commands_, by their clients
  CommandPtr last_;
  /// Of the motion in progress; at first the drive's longest.
  Duration deceleration_ = milliseconds(2000);
  std::uint64_t failures_ = 0;
  TimePoint arrived_{};
  UnseenStart unseen_start_;
};

}  // namespace axisd
