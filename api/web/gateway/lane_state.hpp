// What a page may ask for over its lane, and what becomes of it. Pure: events go in, effects come out.
//
// Of each axis that is jogged over the lane:
//
//            jog                   answer: it runs
//   none -----------> starting ---------------------> running <--+
//    ^ ^               |  ^  |                        |  |  |    | jog (it is renewed)
//    | |  refused,     |  |  | stop, silence, close   |  |  +----+
//    | |  has ended    |  |  |                        |  |
//    | +---------------+  |  |   +--------------------+  | has ended; stop, silence, close
//    |                    |  v   v  the same, while an answer is owed
//    |               jog  +- ending                      |
//    |                          | the last answer        |
//    +--------------------------+------------------------+
//
// Silence, close, and a stop of more than one axis send a Halt at once. A start that is on its way then may
// still come to the drive: from ending a second one goes behind its answer, unless that says that nothing
// runs. A stop of the page is its own first Halt. Where a connection has swallowed an answer, what it had
// taken before may still come out of it: then one more Halt follows after a pause.
//
// A renewal that is refused ends nothing, as what it was to renew goes on until its hold is over. A press
// that was refused, or came too late, stays refused: else it would start while nobody expects it any more.
//
// What goes on by itself once it has started, a move say, goes to the daemon on another connection than stops
// do: there a stop may overtake it. So a Halt of each of its axes follows its answer, where a stop, or the
// end of the lane, came before that. In the same way a StopAll follows a release that it may have overtaken.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/web/gateway/grpc_web.hpp"
#include "api/web/gateway/lane_message.hpp"
#include "api/web/gateway/lane_method.hpp"
#include "api/web/gateway/lateness.hpp"
#include "api/web/gateway/rates.hpp"
#include "buses/clock.hpp"

namespace axisd::web {

/// A call to the daemon.
struct LaneCall {
  std::uint64_t number = 0;
  LaneMethod method = LaneMethod::halt;
  std::string message{};  ///< the request, encoded
  Duration patience{};    ///< until its answer
};
/// Bytes for the page.
struct LaneSend {
  std::string bytes;
};
/// The lane ends: nothing more is taken from the page.
struct LaneClose {
  std::string why;
};
using LaneEffect = std::variant<LaneCall, LaneSend, LaneClose>;
using LaneEffects = std::vector<LaneEffect>;

/// How far an axis is on the way between the press of a button and its standstill.
enum class Jogging : std::uint8_t { none, starting, running, ending };

/// One page's lane. It renews nothing by itself, and starts nothing. Thread: one at a time.
class LaneState {
 public:
  /// Of presses and renewals, beyond the page's fastest message; later ones are not meant any more.
  static constexpr Duration latest = std::chrono::milliseconds(150);
  /// Between an echo and the page's return of its number: then no message is older than it seems by more.
  static constexpr Duration longest_round_trip = std::chrono::milliseconds(300);
  /// So late is no message of a link that works: the page begins anew.
  static constexpr Duration lost = std::chrono::seconds(5);
  /// Calls that wait for their answers.
  static constexpr int most_moves = 32, most_stops = 64;
  /// Messages in a second, and at once.
  static constexpr Pace pace{.per_second = 200, .at_once = 400};
  /// Until a Halt that found nobody is tried again.
  static constexpr Duration pause = std::chrono::milliseconds(100);
  /// A start that comes late is worse than none, and a stop is better late than never.
  static constexpr Duration patience_of_moves = std::chrono::seconds(1),
                            patience_of_stops = std::chrono::seconds(30);
  /// Longer than a page's start is valid (not_after): what is open then starts no more.
  static constexpr Duration patience_of_starts = std::chrono::seconds(10);
  /// Axes of which a refused press is remembered.
  static constexpr std::size_t most_barred = 256;

  /// `random`: numbers that the page cannot know before they reach it.
  explicit LaneState(std::function<std::uint64_t()> random) : random_(std::move(random)) {}

  /// A message of the page.
  [[nodiscard]] LaneEffects receive(std::string_view bytes, TimePoint now);
  /// The call of that number has ended.
  [[nodiscard]] LaneEffects answered(std::uint64_t number, const CallStatus& status,
                                     std::string_view response, TimePoint now);
  /// Time has come to next_due().
  [[nodiscard]] LaneEffects pass(TimePoint now);
  /// The page is gone, or may not be here any more.
  [[nodiscard]] LaneEffects close(TimePoint now);

  /// TimePoint::max(): nothing is due.
  [[nodiscard]] TimePoint next_due() const;
  [[nodiscard]] Jogging jogging(std::string_view axis) const;
  /// Closed, and nothing is owed to any axis.
  [[nodiscard]] bool at_rest() const { return closed_ && axes_.empty() && calls_.empty() && owed_.empty(); }

 private:
  struct Axis {
    Jogging state = Jogging::none;
    int on_the_way = 0;     ///< jogs without an answer
    bool may_run = false;   ///< while ending: an answer said that it runs
    bool unknown = false;   ///< an answer was lost, and what it was to may still come to the daemon
    std::string running{};  ///< the press of which an answer said that it runs
    TimePoint silent_at{};  ///< unless it is renewed before
  };
  struct Pending {
    LaneMethod method = LaneMethod::halt;
    std::optional<std::uint32_t> id{};  ///< of the page; nothing: it is the gateway's own Halt
    std::string axis{};
    std::string press{};              ///< of a jog: its request_id
    std::vector<std::string> axes{};  ///< of a start
    bool overtaken = false;           ///< a stop that came behind it may be executed before it
    TimePoint until{};                ///< own: no Halt is worth more attempts from then on
  };
  /// What an answer says of a jog.
  enum class Outcome : std::uint8_t { runs, over, refused, unknown };
  struct Owed {
    TimePoint at{}, until{};
  };
  using Axes = std::map<std::string, Axis, std::less<>>;

  [[nodiscard]] static Outcome outcome_of(const CallStatus& status, std::string_view response);
  void echo(const LaneRequest& request, TimePoint now, LaneEffects& effects);
  void carry_out(const LaneRequest& request, LaneMethod method, Duration lateness, TimePoint now,
                 LaneEffects& effects);
  void jog(const LaneRequest& request, Duration lateness, TimePoint now, LaneEffects& effects);
  void start(const LaneRequest& request, LaneMethod method, LaneEffects& effects);
  void stop(const LaneRequest& request, LaneMethod method, TimePoint now, LaneEffects& effects);
  /// A stop of that axis comes behind what is on its way; empty: of each.
  void overtake(std::string_view axis);
  /// Why a press or a renewal is not carried out; code 0: it may be.
  [[nodiscard]] CallStatus refusal_of_move() const;
  void call(LaneMethod method, Pending pending, std::string message, Duration patience, LaneEffects& effects);
  void begin(const Press& press, TimePoint now);
  void let_go(const std::string& axis, TimePoint now);
  /// Sends a Halt, and says what is owed to the axis from now on. Returns what comes behind it.
  Axes::iterator halt(Axes::iterator axis, TimePoint now, LaneEffects& effects);
  void halt_all(TimePoint now, LaneEffects& effects);
  void jog_answered(const Pending& jog, Outcome outcome, TimePoint now, LaneEffects& effects);
  void overtaken_answered(const Pending& ended, const CallStatus& status, TimePoint now,
                          LaneEffects& effects);
  void own_halt(const std::string& axis, TimePoint until, TimePoint now, LaneEffects& effects);
  void owe_another(const std::string& axis, TimePoint now);
  [[nodiscard]] bool is_barred(const std::string& axis, std::string_view press) const;
  void bar(const std::string& axis, const std::string& press);
  /// The same, unless it runs already, or may still begin to.
  void bar_start(const Press& press);

  const std::function<std::uint64_t()> random_;
  std::string number_;  ///< of the last echo
  TimePoint echoed_{};
  bool measured_ = false;  ///< one came back
  Lateness lateness_;
  Rate messages_{pace};
  bool closed_ = false;
  std::uint64_t last_number_ = 0;
  int moves_ = 0, stops_ = 0;  ///< of calls_, the page's
  std::map<std::uint64_t, Pending> calls_;
  Axes axes_;
  std::map<std::string, Owed, std::less<>> owed_;  ///< Halts that are to be tried again
  /// Presses that were refused, until the axis gets another one or a stop.
  std::map<std::string, std::string, std::less<>> barred_;
};

}  // namespace axisd::web
