// What the observations of a step mean. Pure.
#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/axisctl/commission/record.pb.h"
#include "axisd/v1/event_service.pb.h"
#include "axisd/v1/system_service.pb.h"
#include "axisd/v1/types.pb.h"

namespace axisd::axisctl::commission {

struct Judgement {
  Verdict verdict = VERDICT_PASSED;
  std::string reason, remedy;
};

/// An input terminal as it should behave.
struct ExpectedInput {
  std::string axis, terminal, function;
  std::string active;  ///< "high", "low"; empty: not known here
};

/// What a drive switches by itself is no hand at a switch, and no wire that was swapped.
bool is_output(const v1::AxisState& axis, const std::string& terminal);

/// The terminal was actuated and released: of the inputs exactly it became active and inactive again.
Judgement judge_switch(const ExpectedInput& expected, const std::vector<v1::TerminalEdge>& edges);
/// It is active although nobody actuates it.
Judgement wrong_polarity(const ExpectedInput& expected);

/// What the operator saw of a move.
enum class Seen : std::uint8_t { as_told, other_way, other_distance, nothing };

struct JogObservation {
  std::string axis;
  v1::Command command;  ///< as it ended
  double distance = 0;  ///< asked, signed
  double travelled = 0;
  double tolerance = 0;
  bool invert = false;             ///< as configured
  bool measured = false;           ///< `travelled` is an encoder's
  bool described_by_file = false;  ///< as of SpeedObservation
  bool in_one_frame = false;       ///< started so, by the configuration
  Seen seen = Seen::as_told;
};
/// Of the move itself, before the operator is asked.
Judgement judge_motion(const JogObservation& jog, const std::string& unit);
/// With what the operator saw.
Judgement judge_jog(const JogObservation& jog, const std::string& unit);

/// A move that was done, with its samples from before its start until after its end: positions are unwrapped,
/// and `distance` is what was told, signed.
struct SpeedObservation {
  std::string axis;
  v1::Command command;
  double distance = 0;
  bool described_by_file = false;  ///< the drive: by a data sheet, with units of its own
  std::vector<v1::AxisState> samples;
};
/// How long the shaft was in the middle of its way, from a tenth of it to nine tenths, s: there neither
/// settling nor the beginning counts. What the samples leave open lies between `least` and `most`.
struct SpeedFigures {
  double told = 0;  ///< by velocity and ramps, which are granted as the drive is sent them
  double least = 0, most = 0;
  double way = 0;  ///< of the middle, user units
};
SpeedFigures measure_speed(const SpeedObservation& move);
struct SpeedJudgement {
  SpeedProof proof = SPEED_PROOF_UNSPECIFIED;  ///< unspecified: the samples do not tell
  Judgement judgement;
};
/// Of a move that did not come where it was told, or was ended: because the axis counts otherwise than its
/// drive.
bool disproves_speed(const v1::Command& command);
/// A speed that is off by some per cent, and by what samples may be late, is wrong; one that could be twice
/// as high, or half, is not known.
SpeedJudgement judge_speed(const SpeedObservation& move, const std::string& unit);

struct LimitObservation {
  ExpectedInput input;
  v1::Command command;                ///< towards the switch, as it ended
  bool became_active = false;         ///< during the move
  std::string other{};                ///< terminal that became active in its place, with its function
  bool stopped = false;               ///< from here, because of `other`
  bool moving = false;                ///< it still moves afterwards
  v1::ExplainResponse further;        ///< on in the same direction
  std::optional<v1::Command> away{};  ///< nothing: the operator left it out
  std::string away_left_out;          ///< why
};
/// The limit switch that became active by this edge in place of `expected`, with its function; empty: none
/// did. Whatever else an axis passes on its way says nothing of the wires.
std::string limit_instead(const v1::TerminalEdge& edge, const std::string& expected);
/// Of the way to the switch alone.
Judgement judge_limit_end(const LimitObservation& limit);
Judgement judge_limit(const LimitObservation& limit);

struct StopObservation {
  v1::Command move, stop;  ///< as they ended
  std::string unit;
  double time = 0;                  ///< from the request's arrival to the confirmed standstill, s
  std::optional<double> bound;      ///< published, s
  double way = 0;                   ///< in that time
  std::optional<double> way_bound;  ///< published, for the velocity of the move
  bool moving = false;              ///< it still moves afterwards
  bool at_target = false;           ///< it rests where the move would have ended without the stop
  bool held = false;                ///< Stopping, until it was released
  v1::ExplainResponse while_held;   ///< a move
  bool released = false;            ///< Standstill afterwards
};
Judgement judge_stop(const StopObservation& stop);

/// A target above, and one below the soft limits.
Judgement judge_soft_limits(const v1::ExplainResponse& above, const v1::ExplainResponse& below);

Judgement judge_homing(const v1::Command& command, const v1::AxisState& after);

/// The obstacle of that reason which blocks, if there is one.
const v1::ErrorDetail* blocked_by(const v1::ExplainResponse& response, v1::Reason reason);

/// How far it went from `since` on until it rested, by the samples before and after that moment; not
/// negative.
double way_since(const google::protobuf::Timestamp& since, const std::vector<v1::AxisState>& samples,
                 double rest);

}  // namespace axisd::axisctl::commission
